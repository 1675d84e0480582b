"""What the fluid conserves: volumes of closed pockets, flow through walls, and the sentinels that look at them."""
