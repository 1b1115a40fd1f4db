"""Draws the printable marks beside this file: `python deploy/mark/draw.py`.

The geometry is the tracker's own (pi_agent/tracking/mark.py), so that what is printed is what is looked for.
"""

from pathlib import Path

from pi_agent.tracking.mark import DOT_PLACE, DOT_RADIUS, TAG_BORDER, Mark, tag_bits

DARK_SHARE = 0.75  # the dark square's side over the label's: leaves a margin of 1/6 of the dark side
MARGIN = (1.0 - DARK_SHARE) / (2.0 * DARK_SHARE)
LABELS_MM = (10.0, 15.0, 20.0)
FIDUCIAL_MM, FIDUCIAL_MARGIN, FIDUCIAL_PLACE_MM, PLATE_MM = 4.0, 0.25, 42.0, 100.0
CUT_LINE = 'fill="none" stroke="#bbb" stroke-width="0.05"'


def label(side_mm: float, *, feature: str) -> str:
    """Returns a label of the given side with its mark.

    It is a document in millimetres with 2 mm of paper around the cutting line.
    """
    mark = Mark(side_mm=DARK_SHARE * side_mm, margin=MARGIN, feature="tag" if feature == "tag" else "dot")
    shapes = [_box(0.0, 0.0, side_mm, CUT_LINE), *_mark(mark, 0.5 * side_mm, 0.5 * side_mm)]
    return _document(side_mm, shapes)


def plate_sheet() -> str:
    """Gives a sheet as large as the plate: four fiducials where the tracker expects them, to be cut out or laid on."""
    mark = Mark(side_mm=FIDUCIAL_MM, margin=FIDUCIAL_MARGIN)
    shapes = [_box(0.0, 0.0, PLATE_MM, CUT_LINE)]
    for sign_x, sign_y in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        x, y = 0.5 * PLATE_MM + sign_x * FIDUCIAL_PLACE_MM, 0.5 * PLATE_MM + sign_y * FIDUCIAL_PLACE_MM
        outer = FIDUCIAL_MM * (1.0 + 2.0 * FIDUCIAL_MARGIN)
        shapes += [_box(x - 0.5 * outer, y - 0.5 * outer, outer, CUT_LINE), *_mark(mark, x, y)]
    return _document(PLATE_MM, shapes)


def drawings() -> dict[str, str]:
    """Returns every document by the name of its file."""
    labels = {f"mark-{side:.0f}mm.svg": label(side, feature="dot") for side in LABELS_MM}
    tags = {f"mark-{side:.0f}mm-tag.svg": label(side, feature="tag") for side in LABELS_MM[1:]}
    return {**labels, **tags, "plate-fiducials.svg": plate_sheet()}


def _mark(mark: Mark, x: float, y: float) -> list[str]:
    side = mark.side_mm
    shapes = [_box(x - 0.5 * side, y - 0.5 * side, side, 'fill="#000"')]
    if mark.feature == "dot":
        place = DOT_PLACE * side
        shapes.append(f'<circle cx="{x + place:.4f}" cy="{y + place:.4f}" r="{DOT_RADIUS * side:.4f}" fill="#fff"/>')
    if mark.feature == "tag":
        bits = tag_bits(mark.tag_dictionary, mark.tag_id)
        cell = side / (len(bits) + 2 * TAG_BORDER)
        for row, line in enumerate(bits):
            for column in range(len(line)):
                if line[column]:
                    left = x - 0.5 * side + (column + TAG_BORDER) * cell
                    top = y - 0.5 * side + (row + TAG_BORDER) * cell
                    shapes.append(_box(left, top, cell, 'fill="#fff"'))
    return shapes


def _box(x: float, y: float, side: float, style: str) -> str:
    return f'<rect x="{x:.4f}" y="{y:.4f}" width="{side:.4f}" height="{side:.4f}" {style}/>'


def _document(side_mm: float, shapes: list[str]) -> str:
    edge = 2.0
    size = side_mm + 2 * edge
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{size:g}mm" height="{size:g}mm" '
        f'viewBox="{-edge:g} {-edge:g} {size:g} {size:g}" shape-rendering="geometricPrecision">'
    )
    return "\n".join([head, *(f"  {shape}" for shape in shapes), "</svg>", ""])


if __name__ == "__main__":
    for name, text in drawings().items():
        (Path(__file__).parent / name).write_text(text)
        print(name)
