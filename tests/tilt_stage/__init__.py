"""The servo tilt stage without its hardware: an emulator, a pty for it, and the sketch compiled for this machine."""
