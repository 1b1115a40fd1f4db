"""The Raspberry Pi's side: camera, tracking at source, corners over the bus."""
