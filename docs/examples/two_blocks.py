"""Two blocks in contact: the upper one is pressed on the lower one by a tenth of its height."""

from coupling import contact_surface
from fsci.shapes import rectangle
from solvers.contact import Contact, Pair
from solvers.march import march
from solvers.structure import Body, NeoHooke, Structure, Support, lame

rubber = NeoHooke(*lame(E=1000.0, nu=0.3))
lower = Body("lower", rectangle([2.0, 1.0], [12, 6]), rubber, supports=[Support("bottom")])
mesh = rectangle([1.0, 1.0], [7, 7], origin=[0.5, 1.0])
upper = Body("upper", mesh, rubber, supports=[Support("top", [0.0, lambda x, t: 0.0 * x[0] - 0.1 * t])])

bodies = [lower, upper]
pair = Pair(slave=contact_surface(bodies, "upper", "bottom"), master=contact_surface(bodies, "lower", "top"))
contact = Contact([pair])
structure = Structure(bodies, contact=contact)

for t, info in march(structure, steps=4):
    force = -structure.residual_force.reshape(-1, 2)[: lower.owned].sum(axis=0)
    nodes = contact.active().sum()
    print(f"t = {t:.2f}: {info.iterations} Newton steps, {nodes} nodes in contact, force {force[1]:.2f} N")
