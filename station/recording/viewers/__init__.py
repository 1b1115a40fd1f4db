"""Every kind of message that a recording holds for viewers alone, one file each; `for_viewers` puts them together."""
