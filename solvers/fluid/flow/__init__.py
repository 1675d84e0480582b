"""The field and its steps, and what is evaluated in them."""
