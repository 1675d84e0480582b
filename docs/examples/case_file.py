"""A case file from Python: run it with another load, and take its steps one after the other."""

from pathlib import Path
from tempfile import TemporaryDirectory

import fsci

FILE = Path(__file__).parents[1] / "tutorials" / "solid" / "case.yaml"

with TemporaryDirectory() as folder:
    case = fsci.load(FILE, {"structure.bodies.flap.pressures.0.value": "4*t", "verify": []})
    results = fsci.run(case, folder)  # as `fsci run`: files, messages, checkpoints
    for time, tip in zip(results["time"], results["tip.x"], strict=True):
        print(f"t = {time:.2f} s: tip {tip:.5f} m with half of the pressure")
    flap = results.fields()["flap"]  # a mesh of pyvista at the last output time
    print("fields:", *flap.point_data)

steps = fsci.build(fsci.load(FILE))  # nothing is written
for time in steps:
    tip = steps.probes()["tip.x"]
    print(f"t = {time:.2f} s: tip {tip:.5f} m after {steps.info.iterations} iterations")
    if tip > 0.3:
        break
flap = steps.fields()["flap"]
print("shapes:", flap.points.shape, flap.point_data["displacement"].shape)
