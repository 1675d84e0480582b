"""Fluid and structure together: what they exchange, and the schemes that bring them into balance."""

from coupling.contact_surface import contact_surface
from coupling.couple import couple, couple_rigid
from coupling.monolithic import Monolithic
from coupling.partitioned import Partitioned

__all__ = ["Monolithic", "Partitioned", "contact_surface", "couple", "couple_rigid"]
