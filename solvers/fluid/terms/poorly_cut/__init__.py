"""What determines the flow in poorly cut cells: ghost penalty and extension."""
