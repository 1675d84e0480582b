"""A ball pressed onto a plane by Kratos, mortar contact by augmented Lagrange multipliers; a script of its Python.

python kratos_hertz.py MESH PRESS: a mesh of `hertz_files.write_kratos`, displacement of the top. Prints a row as JSON.
After the tests of Kratos, ALM_frictionless_contact_test_3D.
"""

import json
import sys
from pathlib import Path
from time import process_time

import KratosMultiphysics as KM
import KratosMultiphysics.ContactStructuralMechanicsApplication
from KratosMultiphysics.StructuralMechanicsApplication.structural_mechanics_analysis import StructuralMechanicsAnalysis

MATERIAL = {
    "properties": [
        {
            "model_part_name": "Structure.Solid",
            "properties_id": 1,
            "Material": {
                "constitutive_law": {"name": "LinearElastic3DLaw"},
                "Variables": {"DENSITY": 1.0, "YOUNG_MODULUS": 1000.0, "POISSON_RATIO": 0.3},
                "Tables": {},
            },
        }
    ]
}


def held(part: str, constrained: list[bool], value: list[float]) -> dict:
    """A support."""
    return {
        "python_module": "assign_vector_variable_process",
        "kratos_module": "KratosMultiphysics",
        "process_name": "AssignVectorVariableProcess",
        "Parameters": {
            "model_part_name": f"Structure.{part}",
            "variable_name": "DISPLACEMENT",
            "constrained": constrained,
            "value": value,
        },
    }


def settings(mesh: Path, materials: Path, press: float) -> dict:
    """One static load step; residuals as small as ours. The direct solver (sparse_lu) takes four times as long."""
    contact = {
        "model_part_name": "Structure",
        "contact_model_part": {"0": ["Contact_Part"]},
        "assume_master_slave": {"0": ["bottom"]},
        "contact_type": "Frictionless",
    }
    return {
        "problem_data": {
            "problem_name": "hertz", "parallel_type": "OpenMP", "start_time": 0.0, "end_time": 1.0, "echo_level": 0,
        },
        "solver_settings": {
            "model_part_name": "Structure",
            "domain_size": 3,
            "solver_type": "Static",
            "echo_level": 1,
            "analysis_type": "non_linear",
            "model_import_settings": {"input_type": "mdpa", "input_filename": str(mesh.with_suffix(""))},
            "material_import_settings": {"materials_filename": str(materials)},
            "contact_settings": {
                "mortar_type": "ALMContactFrictionless",
                "contact_residual_relative_tolerance": 1e-8,
                "contact_residual_absolute_tolerance": 1e-14,
            },
            "time_stepping": {"time_step": 1.1},
            "convergence_criterion": "contact_residual_criterion",
            "displacement_relative_tolerance": 1e-8,
            "displacement_absolute_tolerance": 1e-12,
            "residual_relative_tolerance": 1e-8,
            "residual_absolute_tolerance": 1e-12,
            "max_iteration": 30,
            "linear_solver_settings": {"solver_type": "amgcl", "tolerance": 1e-10, "max_iteration": 500},
            "problem_domain_sub_model_part_list": ["Solid"],
            "processes_sub_model_part_list": ["left", "front", "top", "bottom", "plane", "Contact_Part"],
        },
        "processes": {
            "constraints_process_list": [
                held("left", [True, False, False], [0.0, 0.0, 0.0]),
                held("front", [False, True, False], [0.0, 0.0, 0.0]),
                held("top", [False, False, True], [0.0, 0.0, -press]),
                held("plane", [True, True, True], [0.0, 0.0, 0.0]),
            ],
            "contact_process_list": [
                {
                    "python_module": "alm_contact_process",
                    "kratos_module": "KratosMultiphysics.ContactStructuralMechanicsApplication",
                    "process_name": "ALMContactProcess",
                    "Parameters": contact,
                }
            ],
        },
    }  # fmt: skip


def solve(mesh: Path, press: float) -> dict:
    """Force of the top, pressure at the nodes of the ball's surface, seconds of the processor of the load step."""
    materials = mesh.with_suffix(".materials.json")
    materials.write_text(json.dumps(MATERIAL))
    model = KM.Model()
    analysis = StructuralMechanicsAnalysis(model, KM.Parameters(json.dumps(settings(mesh, materials, press))))
    analysis.Initialize()
    begin = process_time()
    analysis.RunSolutionLoop()
    seconds = process_time() - begin
    structure = model["Structure"]
    top, bottom = structure.GetSubModelPart("top").Nodes, structure.GetSubModelPart("bottom").Nodes
    pressure = KM.KratosGlobals.GetVariable("AUGMENTED_NORMAL_CONTACT_PRESSURE")
    return {
        "dofs": 3 * structure.NumberOfNodes(),
        "newton": structure.ProcessInfo[KM.NL_ITERATION_NUMBER],
        "time [s]": seconds,
        "force": 4 * abs(sum(node.GetSolutionStepValue(KM.REACTION_Z) for node in top)),
        "x": [[node.X0, node.Y0] for node in bottom],
        "pressure": [-node.GetValue(pressure) for node in bottom],
    }


if __name__ == "__main__":
    print(json.dumps(solve(Path(sys.argv[1]), float(sys.argv[2]))))
