"""The effects and the models made of them."""
