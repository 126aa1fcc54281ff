#!/usr/bin/env bash
# usd-core 26.11 has a unit and an axis that points up for each file (`metersPerUnit`, `upAxis`), and composes files without either:
# a cloud in centimetres with z up, referenced by a stage in metres with y up, lies there a hundred times too far away and
# on its side. Its transform to the world is the identity, `GetCompositionErrors` is empty, and a flattened file says metres.
# A file that says nothing counts as one in centimetres.
#
# Guess before it was run: the reference is scaled and turned, as both files say what they are in.
# For whom it matters: whoever brings scans into a scene by USD, or takes clouds and poses out of one: a scene from a renderer is
# in centimetres and y up, a robot's in metres and z up, and the sizes of the parts of one stage may differ by a hundred.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "usd-core==26.11"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

from pxr import Gf, Usd, UsdGeom, Vt


def cloud(name, unit, up):
    """A file with one point a metre along x and one two metres up; nothing is said of a unit that is None."""
    stage = Usd.Stage.CreateNew(name)
    if unit is not None:
        UsdGeom.SetStageMetersPerUnit(stage, unit)
    UsdGeom.SetStageUpAxis(stage, up)
    length = 1.0 / (unit or 1.0)
    high = Gf.Vec3f(0.0, 0.0, 2.0 * length) if up == "Z" else Gf.Vec3f(0.0, 2.0 * length, 0.0)
    points = UsdGeom.Points.Define(stage, "/cloud")
    points.CreatePointsAttr(Vt.Vec3fArray([Gf.Vec3f(length, 0.0, 0.0), high]))
    stage.SetDefaultPrim(points.GetPrim())
    stage.Save()


cloud("robot.usda", 0.01, "Z")
cloud("room.usda", 1.0, "Y")
cloud("silent.usda", None, "Y")
stage = Usd.Stage.CreateNew("scene.usda")
UsdGeom.SetStageMetersPerUnit(stage, 1.0)
UsdGeom.SetStageUpAxis(stage, "Y")
world = {}
for name in ("robot", "room"):
    prim = stage.DefinePrim(f"/{name}")
    prim.GetReferences().AddReference(f"{name}.usda")
    T = UsdGeom.Imageable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
    world[name] = [tuple(T.Transform(Gf.Vec3d(each))) for each in UsdGeom.Points(prim).GetPointsAttr().Get()]

print("usd-core", version("usd-core"))
print(f"  the stage: {UsdGeom.GetStageMetersPerUnit(stage)} m, {UsdGeom.GetStageUpAxis(stage)} up")
for name, points in world.items():
    print(f"  {name}.usda in it:", *points)
unsaid = UsdGeom.GetStageMetersPerUnit(Usd.Stage.Open("silent.usda"))
print(f"  errors: {len(stage.GetCompositionErrors())}; a file that names no unit counts as one of {unsaid} m")
assert world["room"] == [(1.0, 0.0, 0.0), (0.0, 2.0, 0.0)], "usd-core no longer leaves metres as they are"
assert world["robot"] == [(100.0, 0.0, 0.0), (0.0, 0.0, 200.0)], "usd-core now scales or turns what is referenced"
assert not stage.GetCompositionErrors(), "usd-core now tells"
assert unsaid == 0.01, "usd-core now takes another unit where none is named"
print("lays centimetres on metres")
PYTHON
