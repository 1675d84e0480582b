"""Turek and Hron's FSI1 by Kratos on fitted meshes, coupled by its quasi-Newton scheme; a script of its Python.

python kratos_fsi1.py FLUID FLAG: meshes of `fsi1_files`. Prints a row as JSON. One step, long enough to be steady.
After the tests of Kratos, MokBenchmarkTest.
"""

import json
import sys
from pathlib import Path
from time import process_time

import KratosMultiphysics as KM
import KratosMultiphysics.ConstitutiveLawsApplication
import KratosMultiphysics.LinearSolversApplication
from KratosMultiphysics.FSIApplication.fsi_analysis import FsiAnalysis

STEP = 1e4  #: [s]; the flag's velocity is then 1e-7 of the flow's
DENSITY, VISCOSITY, MU, NU = 1000.0, 1.0, 0.5e6, 0.4
HEIGHT, MEAN = 0.41, 0.2
REFERENCE = {"u_x": 2.270493e-5, "u_y": 8.208773e-4, "drag": 14.29426, "lift": 0.7637460}


def material(part: str, law: str, number: int, variables: dict) -> dict:
    content = {"constitutive_law": {"name": law}, "Variables": variables, "Tables": {}}
    return {"properties": [{"model_part_name": part, "properties_id": number, "Material": content}]}


FLUID = material("Fluid.Fluid", "Newtonian2DLaw", 1, {"DENSITY": DENSITY, "DYNAMIC_VISCOSITY": VISCOSITY})
FLAG = material(
    "Flag.Solid", "LinearElasticPlaneStrain2DLaw", 1,
    {"DENSITY": DENSITY, "YOUNG_MODULUS": 2.0 * MU * (1.0 + NU), "POISSON_RATIO": NU, "THICKNESS": 1.0},
)  # fmt: skip


def read(mesh: Path, content: dict, **stepping: bool) -> dict:
    """Settings of a mesh and its material."""
    path = mesh.with_suffix(".materials.json")
    path.write_text(json.dumps(content))
    return {
        "domain_size": 2,
        "echo_level": 0,
        "model_import_settings": {"input_type": "mdpa", "input_filename": str(mesh.with_suffix(""))},
        "material_import_settings": {"materials_filename": str(path)},
        "time_stepping": {"time_step": STEP, **stepping},
    }


def settings(fluid: Path, flag: Path) -> dict:
    direct = {"solver_type": "LinearSolversApplication.sparse_lu"}
    return {
        "problem_data": {
            "problem_name": "fsi1", "parallel_type": "OpenMP", "echo_level": 0,
            "start_time": 0.0, "end_time": 0.5 * STEP,
        },
        "solver_settings": {
            "solver_type": "partitioned",
            "coupling_scheme": "dirichlet_neumann",
            "echo_level": 0,
            "structure_solver_settings": {
                **read(flag, FLAG),
                "solver_type": "Static",
                "model_part_name": "Flag",
                "analysis_type": "non_linear",
                "convergence_criterion": "residual_criterion",
                "residual_relative_tolerance": 1e-8,
                "residual_absolute_tolerance": 1e-10,
                "max_iteration": 15,
                "rotation_dofs": False,
                "linear_solver_settings": direct,
            },
            "fluid_solver_settings": {
                **read(fluid, FLUID, automatic_time_step=False),
                "solver_type": "Monolithic",
                "model_part_name": "Fluid",
                "compute_reactions": True,
                "maximum_iterations": 30,
                "relative_velocity_tolerance": 1e-5,
                "absolute_velocity_tolerance": 1e-10,
                "relative_pressure_tolerance": 1e-5,
                "absolute_pressure_tolerance": 1e-10,
                "volume_model_part_name": "Fluid",
                "skin_parts": ["wet", "cylinder", "walls", "outlet", "inlet"],
                "no_skin_parts": [],
                "formulation": {"element_type": "vms", "dynamic_tau": 0.0},
                "linear_solver_settings": direct,
            },
            "mesh_solver_settings": {
                "echo_level": 0,
                "domain_size": 2,
                "model_part_name": "Fluid",
                "solver_type": "structural_similarity",
                "linear_solver_settings": direct,
            },
            "coupling_settings": {
                "nl_tol": 1e-8,
                "nl_max_it": 40,
                "solve_mesh_at_each_iteration": True,
                "coupling_strategy_settings": {"solver_type": "MVQN", "w_0": 0.825},
                "structure_interfaces_list": ["Flag.wet"],
                "fluid_interfaces_list": ["Fluid.wet"],
                "mapper_settings": [
                    {
                        "mapper_face": "unique",
                        "fluid_interface_submodelpart_name": "Fluid.wet",
                        "structure_interface_submodelpart_name": "Flag.wet",
                    }
                ],
            },
        },
        "processes": {},
    }  # fmt: skip


class Fsi1(FsiAnalysis):
    """Holds what is held: no processes are needed for values that do not change."""

    def ModifyInitialGeometry(self) -> None:
        fluid, flag = self.model["Fluid"], self.model["Flag"]
        for node in flag.GetSubModelPart("root").Nodes:
            hold(node, KM.DISPLACEMENT_X, KM.DISPLACEMENT_Y)
        for name in ("cylinder", "walls", "inlet", "outlet"):
            for node in fluid.GetSubModelPart(name).Nodes:
                hold(node, KM.MESH_DISPLACEMENT_X, KM.MESH_DISPLACEMENT_Y)
        for node in fluid.GetSubModelPart("outlet").Nodes:
            hold(node, KM.PRESSURE)
        for node in fluid.GetSubModelPart("inlet").Nodes:
            hold(node, KM.VELOCITY_X, KM.VELOCITY_Y)
            node.SetSolutionStepValue(KM.VELOCITY_X, 0, 6.0 * MEAN * node.Y * (HEIGHT - node.Y) / HEIGHT**2)
        for name in ("cylinder", "walls"):
            for node in fluid.GetSubModelPart(name).Nodes:
                hold(node, KM.VELOCITY_X, KM.VELOCITY_Y)
                node.SetSolutionStepValue(KM.VELOCITY_X, 0, 0.0)


def hold(node: KM.Node, *variables: KM.DoubleVariable) -> None:
    for variable in variables:
        node.Fix(variable)


def solve(fluid: Path, flag: Path) -> dict:
    """Errors of the flag's tip and of the force, seconds of the processor of the step."""
    model = KM.Model()
    analysis = Fsi1(model, KM.Parameters(json.dumps(settings(fluid, flag))))
    analysis.Initialize()
    begin = process_time()
    analysis.RunSolutionLoop()
    seconds = process_time() - begin
    nodes = {node.Id for name in ("wet", "cylinder") for node in model[f"Fluid.{name}"].Nodes}
    reactions = [model["Fluid"].Nodes[number].GetSolutionStepValue(KM.REACTION) for number in nodes]
    tip = min(model["Flag"].Nodes, key=lambda node: abs(node.X0 - 0.6) + abs(node.Y0 - 0.2))
    found = {
        "u_x": tip.GetSolutionStepValue(KM.DISPLACEMENT_X),
        "u_y": tip.GetSolutionStepValue(KM.DISPLACEMENT_Y),
        "drag": -sum(force[0] for force in reactions),
        "lift": -sum(force[1] for force in reactions),
    }
    return {
        "dofs": 3 * model["Fluid"].NumberOfNodes() + 2 * model["Flag"].NumberOfNodes(),
        "time [s]": seconds,
        **{f"{name} error [%]": 100.0 * (value / REFERENCE[name] - 1.0) for name, value in found.items()},
    }


if __name__ == "__main__":
    print(json.dumps(solve(Path(sys.argv[1]), Path(sys.argv[2]))))
