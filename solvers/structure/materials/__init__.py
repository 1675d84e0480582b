"""Hyperelastic materials, one law per file."""

from solvers.structure.materials.coup_neo_hooke import CoupNeoHooke
from solvers.structure.materials.holzapfel_gasser_ogden import HolzapfelGasserOgden
from solvers.structure.materials.linear_elastic import LinearElastic, PlaneStressLinearElastic
from solvers.structure.materials.material import Material, Tensor, in_space, parameters
from solvers.structure.materials.mooney_rivlin import MooneyRivlin
from solvers.structure.materials.neo_hooke import NeoHooke
from solvers.structure.materials.ogden import Ogden
from solvers.structure.materials.st_venant_kirchhoff import PlaneStressStVenantKirchhoff, StVenantKirchhoff
from solvers.structure.materials.yeoh import Yeoh
