"""The differences between Linux, macOS and Windows.

Nothing else in this program asks which system it runs on. Each name is settled once, when it is imported, and means the
same on every system; what a system lacks is replaced here or reported in one sentence. What runs on the Raspberry Pi
alone (the installation, cameras) is no part of this.
"""
