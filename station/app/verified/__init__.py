"""Parts of a recording that are derived again; each module compares one kind with what was recorded."""
