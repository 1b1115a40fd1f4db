"""The effects, one file each; a file is found by being here."""
