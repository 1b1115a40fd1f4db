"""The figures of an analysis in Rerun, as data that can be hovered, zoomed and read back, not as pictures."""
