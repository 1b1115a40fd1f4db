"""A repeat is known by its stamp, as far back as the cache of its topic goes."""

from shared.repeats import Repeats


def test_a_stamp_is_seen_again_while_it_is_among_the_last() -> None:
    last = Repeats(2)
    seen = [last.seen(each) for each in "abacba"]
    assert seen == [False, False, True, False, True, False]


def test_without_a_cache_nothing_is_a_repeat() -> None:
    none = Repeats(0)
    assert not any(none.seen("a") for _ in range(3))
