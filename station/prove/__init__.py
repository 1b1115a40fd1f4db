"""The proof on concealed data: cases by an independent generator, one blind run of the tool, then the sealed key."""
