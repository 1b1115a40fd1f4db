"""The station's processes and commands: where the parts are put together."""
