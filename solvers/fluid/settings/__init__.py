"""What a user sets: fluid, element, time scheme, factors of the stabilisation."""
