"""The geometry-nodes group that shows a pattern's features: dark discs where the holes will be."""

from __future__ import annotations

from typing import Any

import bpy

GROUP = "Bubble Pattern Preview"
MODIFIER = "Bubble Pattern"
MATERIAL = "Bubble Pattern Preview"
VERSION_KEY = "bubble_pattern_version"
VERSION = 3

# A disc is this thick relative to its diameter: it stands a little proud of a curved surface, seen from
# either side.
THICKNESS = 0.16
SIDES = 32
DARK = (0.012, 0.012, 0.014, 1.0)


def preview_group() -> bpy.types.NodeTree:
    """The group of this version: made where it lacks, rebuilt in place where it is older."""
    for group in bpy.data.node_groups:
        if VERSION_KEY in group and group.library is None and group.bl_idname == 'GeometryNodeTree':
            if group[VERSION_KEY] < VERSION:
                build(group)
            return group
    group = bpy.data.node_groups.new(GROUP, 'GeometryNodeTree')
    build(group)
    return group


def build(group: bpy.types.NodeTree) -> None:
    """Lay sockets, nodes and links of the current version into `group`, whatever it held."""
    group.nodes.clear()
    group.interface.clear()
    group.is_modifier = True
    new_socket = group.interface.new_socket
    new_socket("Geometry", in_out='INPUT', socket_type='NodeSocketGeometry')
    bubbles = new_socket("Show Bubbles", in_out='INPUT', socket_type='NodeSocketBool')
    bubbles.description = "Draw the territory of every feature as a ring"
    material = new_socket("Material", in_out='INPUT', socket_type='NodeSocketMaterial')
    material.description = "Material of the previewed features"
    shape = new_socket("Shape", in_out='INPUT', socket_type='NodeSocketObject')
    shape.description = "What stands for a feature of the diameter 1, or nothing for a disc"
    shaped = new_socket("Use Shape", in_out='INPUT', socket_type='NodeSocketBool')
    shaped.description = "Show the shape in place of a disc"
    new_socket("Geometry", in_out='OUTPUT', socket_type='NodeSocketGeometry')

    node, link = group.nodes.new, group.links.new
    given, result = node('NodeGroupInput'), node('NodeGroupOutput')
    rotation = named_attribute(group, "rotation", 'QUATERNION')

    disc = node('GeometryNodeMeshCylinder')
    disc.inputs["Vertices"].default_value = SIDES
    disc.inputs["Radius"].default_value = 0.5
    disc.inputs["Depth"].default_value = THICKNESS
    painted = node('GeometryNodeSetMaterial')
    link(disc.outputs["Mesh"], painted.inputs["Geometry"])
    link(given.outputs["Material"], painted.inputs["Material"])
    own = node('GeometryNodeObjectInfo')
    link(given.outputs["Shape"], own.inputs["Object"])
    either = node('GeometryNodeSwitch')
    either.input_type = 'GEOMETRY'
    link(given.outputs["Use Shape"], either.inputs["Switch"])
    link(painted.outputs["Geometry"], either.inputs["False"])
    link(own.outputs["Geometry"], either.inputs["True"])
    features = instances(group, given, either.outputs["Output"], rotation, "diameter")
    # none where the feature was left out, whose diameter is 0
    link(named_attribute(group, "diameter", 'FLOAT').outputs["Attribute"], features.inputs["Selection"])

    ring = node('GeometryNodeMeshCircle')
    ring.inputs["Vertices"].default_value = SIDES
    ring.inputs["Radius"].default_value = 0.5
    rings = instances(group, given, ring.outputs["Mesh"], rotation, "pitch")
    link(given.outputs["Show Bubbles"], rings.inputs["Selection"])

    both = node('GeometryNodeJoinGeometry')
    link(rings.outputs["Instances"], both.inputs["Geometry"])
    link(features.outputs["Instances"], both.inputs["Geometry"])
    link(both.outputs["Geometry"], result.inputs["Geometry"])
    arrange(group)
    group[VERSION_KEY] = VERSION


def named_attribute(group: bpy.types.NodeTree, name: str, data_type: str) -> bpy.types.Node:
    """A node that reads the attribute `name` of the points."""
    node = group.nodes.new('GeometryNodeInputNamedAttribute')
    node.data_type = data_type
    node.inputs["Name"].default_value = name
    return node


def instances(
    group: bpy.types.NodeTree, given: Any, shape: bpy.types.NodeSocket, rotation: Any, size: str
) -> bpy.types.Node:
    """A node that puts `shape` on every point, turned by its rotation and scaled by the attribute `size`."""
    node = group.nodes.new('GeometryNodeInstanceOnPoints')
    link = group.links.new
    link(given.outputs["Geometry"], node.inputs["Points"])
    link(shape, node.inputs["Instance"])
    link(rotation.outputs["Attribute"], node.inputs["Rotation"])
    link(named_attribute(group, size, 'FLOAT').outputs["Attribute"], node.inputs["Scale"])
    return node


def arrange(group: bpy.types.NodeTree) -> None:
    """Set the nodes in columns, each right of what it takes from."""
    column = {node.name: 0 for node in group.nodes}
    for _ in group.nodes:
        for link in group.links:
            column[link.to_node.name] = max(column[link.to_node.name], column[link.from_node.name] + 1)
    filled: dict[int, int] = {}
    for node in group.nodes:
        at = column[node.name]
        node.location = (at * 220, -filled.get(at, 0) * 200)
        filled[at] = filled.get(at, 0) + 1


def preview_material(name: str = MATERIAL, color: tuple[float, ...] = DARK) -> bpy.types.Material:
    """The dark material of previewed holes, or another one."""
    material = bpy.data.materials.get(name)
    if material is None:
        material = bpy.data.materials.new(name)
        material.diffuse_color = color
        material.roughness = 1.0
        if bpy.app.version < (5, 0, 0):  # from 5.0 on every material has nodes
            material.use_nodes = True
        shader = material.node_tree.nodes.get("Principled BSDF")
        if shader is not None:
            shader.inputs["Base Color"].default_value = color
            shader.inputs["Roughness"].default_value = 1.0
    return material


def set_input(modifier: bpy.types.Modifier, name: str, value: Any) -> None:
    """Give the modifier's input `name` a value, on every Blender version."""
    item = next(i for i in modifier.node_group.interface.items_tree if i.name == name and i.in_out == 'INPUT')
    if hasattr(modifier, "properties"):  # Blender 5.2 and later
        getattr(modifier.properties.inputs, item.identifier).value = value
    else:
        modifier[item.identifier] = value
    modifier.id_data.update_tag()


def show_preview(obj: bpy.types.Object, bubbles: bool = False) -> None:
    """Let the preview's modifier stand on the pattern object, with the group of this version."""
    modifier = obj.modifiers.get(MODIFIER) or obj.modifiers.new(MODIFIER, 'NODES')
    modifier.node_group = preview_group()
    modifier.show_expanded = False
    set_input(modifier, "Material", preview_material())
    set_input(modifier, "Show Bubbles", bubbles)
    show_shape(obj)


def show_shape(obj: bpy.types.Object) -> None:
    """Let what stands for the features look like them: see feature_shapes."""
    from .feature_shapes import drop_unused, shape_object

    modifier = obj.modifiers.get(MODIFIER)
    if modifier is None or modifier.node_group is None:
        return
    shape = shape_object(obj)
    set_input(modifier, "Shape", shape)
    set_input(modifier, "Use Shape", shape is not None)
    drop_unused()
