"""Puts the camera agent onto a Pi over ssh, or takes it off again. `target` is the part that runs on the Pi."""
