"""Installs, activates, rolls back and removes the agent; this runs on the target, as root.

It is sent there as one zip archive and uses the standard library alone. Every release keeps a copy (`deploy.pyz`), so
that `sudo python3 /opt/repose/current/deploy.pyz status` works without the laptop.
"""
