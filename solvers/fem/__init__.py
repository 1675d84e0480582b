"""All that differs between versions of DOLFINx: meshes, spaces, compiled forms, values at points.

A node is a point of the mesh file, numbered as there on every process; a dof block is DOLFINx's local number of a node.
Elements are isoparametric, so that the nodes of the mesh and of the displacement are the same points.
"""

import mpi4py.MPI  # DOLFINx from PyPI finds its MPI only after this

from solvers.fem.compiling import listening
from solvers.fem.domain import (
    Destinations,
    Domain,
    boundary_facets,
    distribute,
    exterior_facets,
    facet_midpoints,
    input_cells,
    input_nodes,
    interior_facets,
    owned_cells,
    vtk_from_basix,
)
from solvers.fem.facewise import Facewise
from solvers.fem.forms import (
    COMPILE_OPTIONS,
    Integral,
    assemble_components,
    assemble_matrix,
    assemble_scalar,
    assemble_vector,
    compile_expression,
    compile_form,
    compile_forms,
    compile_integrals,
    constant,
    create_matrix,
    direction,
    measure,
    surface_measure,
    volume_measure,
)
from solvers.fem.ghosts import accumulate, add_ghosts, share_owned, sum_ghosts
from solvers.fem.points import average_at_nodes, cell_midpoints, evaluate_cells, locate_point, reference_nodes, tabulate
from solvers.fem.pointwise import Pointwise, numbers_of_cells
from solvers.fem.quadrature import Entities, cell_quadrature, facet_quadrature
from solvers.fem.spaces import (
    block_points,
    broken_space,
    cell_blocks,
    cellwise_space,
    component_cell_dofs,
    component_dofs,
    facet_dofs,
    flow_space,
    function,
    identify_blocks,
    node_heights,
    node_of_block,
    node_steps,
    pressure_space,
    quadrature_points,
    quadrature_space,
    scalar_space,
    surface_blocks,
    tabulate_lagrange,
    vector_space,
)
