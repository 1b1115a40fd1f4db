"""Rights on the bus: each process may send, serve and ask what the one table of topics says is its own.

They hold where every process has a certificate whose common name is in `rights.toml` (`station keys new` writes both).
Each process checks what arrives by the sender's certificate, whatever the sender says, and denies what no rule allows:
https://zenoh.io/docs/manual/access-control/. All members may listen to everything; that is what recorders are for.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from shared.rig import PROCESSES
from shared.topics import ANGLE_PREFIX, SERVICES, TOPICS

OBSERVER = "observer"
"""The role of those who look on: recorder, viewer, angle sensors, the emergency stop from a shell."""

ROLES = (*PROCESSES, OBSERVER)

Members = Mapping[str, Sequence[str]]
"""The common names of the certificates that count, by role. One that is not here has no rights."""

_LISTEN = ("declare_subscriber", "declare_liveliness_subscriber", "liveliness_query")
_SEND = ("put", "delete", "reply")
_BE_THERE = ("declare_queryable", "liveliness_token")
_ALL = (*_LISTEN, *_SEND, *_BE_THERE, "query")
_CACHE = "@adv/**"
"""The part below a topic's key that Zenoh's advanced publisher keeps and announces. `**` alone does not reach it."""


def access_control(rig_id: str, members: Members, *, process: str = OBSERVER) -> dict[str, Any]:
    """Returns Zenoh's settings `access_control` of one process of the rig.

    There is one camera agent, arm agent and station at a time: none of them lets in what another one of its own role
    sends or asks. What it sends to the others is for them to judge, as the arm agent does with its lease.
    """
    prefix = f"repose/{rig_id}"
    able = {role: tuple(names) for role, names in members.items() if names}
    rules = [
        _rule("listen", "ingress", _LISTEN, [f"{prefix}/**", f"{prefix}/@alive/*", f"{prefix}/**/{_CACHE}"]),
        _rule("recover", "ingress", ("query", "reply"), [f"{prefix}/**/{_CACHE}"]),
        _rule("hear", "egress", _ALL, [f"{prefix}/**", f"{prefix}/@alive/*", f"{prefix}/**/{_CACHE}"]),
    ]
    policies = [{"subjects": list(able), "rules": [rule["id"] for rule in rules]}]
    for role in (role for role in able if not is_rival(role, process)):
        own = _own_rules(role, prefix)
        rules += own
        policies.append({"subjects": [role], "rules": [rule["id"] for rule in own]})
    subjects = [{"id": role, "cert_common_names": list(names)} for role, names in able.items()]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def is_rival(role: str, process: str) -> bool:
    """Returns true if a role is that of a process of which there is one at a time."""
    return role == process != OBSERVER


def _own_rules(role: str, prefix: str) -> list[dict[str, Any]]:
    sent = [f"{prefix}/{name}" for name in sent_by(role)]
    served = [f"{prefix}/{name}" for name, service in SERVICES.items() if service.server == role]
    asked = [f"{prefix}/{name}" for name, service in SERVICES.items() if service.asker in (role, "any")]
    caches = [f"{key}/{_CACHE}" for key in sent]
    rules = [
        _rule(f"send {role}", "ingress", _SEND, [*sent, *caches]),
        _rule(f"exist {role}", "ingress", _BE_THERE, [*caches, f"{prefix}/@alive/{role}"]),
        _rule(f"serve {role}", "ingress", ("declare_queryable", "reply"), served),
        _rule(f"ask {role}", "ingress", ("query",), asked),
    ]
    return [rule for rule in rules if rule["key_exprs"]]


def sent_by(role: str) -> list[str]:
    """Returns the topics that a role may send; `angle/*` stands for every angle sensor's."""
    return [*(name for name, topic in TOPICS.items() if topic.sender in (role, "any")), f"{ANGLE_PREFIX}*"]


def _rule(name: str, flow: str, messages: Iterable[str], keys: list[str]) -> dict[str, Any]:
    return {"id": name, "permission": "allow", "flows": [flow], "messages": list(messages), "key_exprs": keys}
