"""The diagnosis says where recording and simulation differ, which physics is missing, and how much it explains."""
