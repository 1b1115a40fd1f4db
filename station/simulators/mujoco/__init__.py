"""The twin: a MuJoCo world of arm, plate and block that stands in for the hardware."""
