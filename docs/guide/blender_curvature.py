"""Colour a mesh by its curvature: blender --background --python blender_curvature.py -- mesh.ply mesh.blend

mesh.ply is what `quadcurv curvature mesh.obj -o mesh.ply -v mean_curvature` wrote.
"""

import sys

import bpy
import numpy as np

ply, blend = sys.argv[sys.argv.index("--") + 1 :]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.ply_import(filepath=ply)
mesh = bpy.context.selected_objects[0].data

H = np.empty(len(mesh.vertices), np.float32)
mesh.attributes["mean_curvature"].data.foreach_get("value", H)
end = np.nanquantile(np.abs(H), 0.95)
part = np.nan_to_num(H / end).clip(-1, 1)  # -1 blue, 0 white, 1 red; undefined white
rgba = np.stack((1 + part.clip(max=0), 1 - np.abs(part), 1 - part.clip(min=0), np.ones_like(part)), axis=1)
colours = mesh.color_attributes.new("curvature", "FLOAT_COLOR", "POINT")
colours.data.foreach_set("color", rgba.ravel())

material = bpy.data.materials.new("curvature")
material.use_nodes = True
nodes = material.node_tree.nodes
attribute = nodes.new("ShaderNodeVertexColor")
attribute.layer_name = "curvature"
material.node_tree.links.new(attribute.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
mesh.materials.append(material)
bpy.ops.wm.save_as_mainfile(filepath=blend)
print(f"{len(mesh.polygons)} faces, H from {np.nanmin(H):.4g} to {np.nanmax(H):.4g}")
