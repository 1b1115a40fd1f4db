"""Makes recordings in which an effect is concealed, independently of everything that has to find it (see README.md)."""
