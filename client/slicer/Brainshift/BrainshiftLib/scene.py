# SPDX-License-Identifier: Apache-2.0
"""The nodes of the scene that show a field: its transform, what follows it, its uncertainty, the deformed surfaces.

Needs Slicer, unlike label, grid and colours beside it.
"""
from __future__ import annotations

from typing import Callable, NamedTuple

import slicer
import vtk

from .colours import FULL_SCALE_MM, known_colours, sd_colours
from .grid import FieldError, field_from_image, grid_transform, value_at
from .label import LabelError, belongs, parse_metadata

# The devices of `brainshift bridge`; SlicerOpenIGTLink gives their nodes the same names.
FIELD, SD, KNOWN, STATE = "brainshift_u", "brainshift_sd", "brainshift_known", "brainshift_state"
SURFACES = ("brainshift_tumour", "brainshift_cortex", "brainshift_ventricles", "brainshift_septa")
_CLASSES = {FIELD: "vtkMRMLVectorVolumeNode", SD: "vtkMRMLScalarVolumeNode", KNOWN: "vtkMRMLScalarVolumeNode",
            STATE: "vtkMRMLTextNode"}


class Overlay(NamedTuple):
    """A volume that may lie over the slices."""

    has: str  # the truth of the label that says whether it holds anything
    full_scale: float
    unit: str
    colours: Callable
    clear_below: float  # under it nothing is drawn


# 0 of the standard deviation is the outside of the brain. 0 of what is known is a guess: it is drawn, outside too.
OVERLAYS = {SD: Overlay("has_sd", FULL_SCALE_MM, " mm", sd_colours, 1e-3),
            KNOWN: Overlay("has_known", 1.0, "", known_colours, 0.0)}
TRANSFORM = "brainshift_transform"
# A singleton's ID is its class and this tag. Slicer writes a node's reference to the transform into a scene file although
# the transform itself is not saved. With an ID that no other node takes, the reference can never find another transform.
SINGLETON = "Brainshift"


def field_of(node, components=3):
    """The VectorField of a volume node. Raises FieldError."""
    matrix = vtk.vtkMatrix4x4()
    node.GetIJKToRASMatrix(matrix)
    rows = [[matrix.GetElement(row, column) for column in range(4)] for row in range(4)]
    return field_from_image(node.GetImageData(), rows, components)


def bridge_node(name):
    """The node of a device, or None."""
    return slicer.mrmlScene.GetFirstNode(name, _CLASSES.get(name, "vtkMRMLModelNode"))


class SceneNodes:
    def __init__(self):
        self.largest_mm = None  # of the field that is shown
        self.overlay_wanted = None  # one of OVERLAYS
        self._built = None      # the VectorField that the transform was made of; None: there is no transform
        self._followers = []    # ids of the nodes that the user chose
        self._transform_id = self._overlay_on = None
        self._colour_ids = {}   # by overlay
        self._behind = {}       # device -> since when its data have been of another update than the field
        self._hidden = set()    # ids of the surfaces that were visible and were hidden here

    def set_followers(self, nodes):
        """Volumes and models that the field moves. Returns one line for every node that is refused."""
        refused, chosen = [], []
        for node in nodes:
            if node.GetName() in (FIELD, *OVERLAYS, *SURFACES):
                refused.append(f"{node.GetName()} comes from the bridge and is deformed already")
            elif node.GetTransformNodeID() not in (None, "", self._transform_id):
                refused.append(f"{node.GetName()} lies under another transform: harden that one first")
            else:
                chosen.append(node.GetID())
        for node_id in set(self._followers) - set(chosen):
            self._detach(slicer.mrmlScene.GetNodeByID(node_id))
        self._followers = chosen
        return refused

    def show(self, field, label, now):
        """A checked VectorField and the label that came with it; seconds of a clock."""
        node = self._transform_node()
        if self._built is not field:
            node.SetAndObserveTransformToParent(grid_transform(field, slicer.vtkOrientedGridTransform))
            self._built = field
            self.largest_mm = float(field.magnitudes_mm.max())
        for node_id in self._followers:
            follower = slicer.mrmlScene.GetNodeByID(node_id)
            # A node that the user has put under another transform since then is left alone.
            if follower is not None and not follower.GetTransformNodeID():
                follower.SetAndObserveTransformNodeID(node.GetID())
        name = self.overlay_wanted
        shown = name is not None and getattr(label, OVERLAYS[name].has) and self._goes_with(name, label, now)
        self._show_overlay(name if shown else None)
        for name in SURFACES:
            self._set_surface_visible(name, self._goes_with(name, label, now))

    def at_cursor(self, field, label, now):
        """What is at the mouse cursor over a slice: where its place in the room was in the MRI, how far it moved, and how
        sure that is. Empty where the cursor is over no slice, or outside of the field."""
        crosshair = slicer.mrmlScene.GetFirstNodeByClass("vtkMRMLCrosshairNode")
        room = [0.0, 0.0, 0.0]
        if crosshair is None or not crosshair.GetCursorPositionRAS(room):
            return ""
        place = self._transform_node().GetTransformToParent().GetInverse().TransformPoint(room)
        u = value_at(field, place)
        if u is None or not u.any():
            return ""
        numbers = {}
        for name in OVERLAYS:
            if getattr(label, OVERLAYS[name].has) and self._goes_with(name, label, now):
                try:
                    found = value_at(field_of(bridge_node(name), 1), place)
                except FieldError:
                    continue
                if found is not None:
                    numbers[name] = float(found[0])
        moved = f"moved {float((u @ u) ** 0.5):.1f}" + (f" \u00b1 {numbers[SD]:.1f}" if SD in numbers else "") + " mm"
        known = f", {100.0 * numbers[KNOWN]:.0f} % known by the data" if KNOWN in numbers else ""
        return f"R {place[0]:.1f}, A {place[1]:.1f}, S {place[2]:.1f} mm of the MRI {moved}{known}"

    def take_away(self):
        for node_id in self._followers:
            self._detach(slicer.mrmlScene.GetNodeByID(node_id))
        node = self._existing_transform_node()
        if node is not None and self._built is not None:
            node.SetAndObserveTransformToParent(None)
        self._built = self.largest_mm = None
        self._show_overlay(None)
        for name in SURFACES:
            self._set_surface_visible(name, False)

    def forget(self):
        """The scene was closed. Slicer keeps singletons then, so the transform has to be removed here: a volume of the next
        scene might name it."""
        self.take_away()
        node = self._existing_transform_node()
        if node is not None:
            slicer.mrmlScene.RemoveNode(node)
        wanted = self.overlay_wanted
        self.__init__()
        self.overlay_wanted = wanted  # as the panel's boxes still say

    def release_surfaces(self):
        """After the end of a connection: surfaces that were hidden here stay hidden and are the user's again."""
        self._hidden.clear()

    def detach_strangers(self):
        """Nodes of a loaded scene that followed the transform when the scene was saved. Nobody chose them in this one."""
        for node in slicer.util.getNodesByClass("vtkMRMLTransformableNode"):
            if node.GetID() not in self._followers:
                self._detach(node)

    def _existing_transform_node(self):
        return None if self._transform_id is None else slicer.mrmlScene.GetNodeByID(self._transform_id)

    def _transform_node(self):
        node = self._existing_transform_node()
        if node is None:
            node = slicer.vtkMRMLGridTransformNode()
            node.SetName(TRANSFORM)
            node.SetSingletonTag(SINGLETON)
            node.SetSaveWithScene(False)  # a saved field would be shown, without a word, when the scene is opened again
            node = slicer.mrmlScene.AddNode(node)
            self._transform_id, self._built = node.GetID(), None
            self.detach_strangers()
        return node

    def _detach(self, node):
        if node is not None and self._transform_id is not None and node.GetTransformNodeID() == self._transform_id:
            node.SetAndObserveTransformNodeID(None)

    def _show_overlay(self, name):
        if name == self._overlay_on:
            return
        self._overlay_on = name
        if name is None:
            slicer.util.setSliceViewerLayers(foreground=None)
            return
        overlay, volume = OVERLAYS[name], bridge_node(name)
        display = volume.GetDisplayNode()  # the connector makes it with the volume
        display.SetAndObserveColorNodeID(self._colour_node(name).GetID())
        display.SetAutoWindowLevel(0)
        display.SetWindowLevelMinMax(0.0, overlay.full_scale)
        display.SetLowerThreshold(overlay.clear_below)
        display.SetApplyThreshold(int(overlay.clear_below > 0.0))
        slicer.util.setSliceViewerLayers(foreground=volume, foregroundOpacity=0.4)

    def _colour_node(self, name):
        node = slicer.mrmlScene.GetNodeByID(self._colour_ids[name]) if name in self._colour_ids else None
        if node is None:
            overlay = OVERLAYS[name]
            node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLColorTableNode", f"{name}_colours")
            node.SetTypeToUser()
            node.SetSaveWithScene(False)
            colours = overlay.colours()
            node.SetNumberOfColors(len(colours))
            for index, (red, green, blue) in enumerate(colours):
                value = index * overlay.full_scale / (len(colours) - 1)
                node.SetColor(index, f"{value:.2f}{overlay.unit}", red, green, blue, 1.0)
            self._colour_ids[name] = node.GetID()
        return node

    def _goes_with(self, name, label, now):
        """Whether the data of a device are there and may be shown with the field."""
        node = bridge_node(name)
        try:
            own = None if node is None else parse_metadata(node.GetAttribute)
        except LabelError:
            return False
        if own is None or own.sequence == label.sequence:
            self._behind.pop(name, None)
        else:
            self._behind.setdefault(name, now)
        return belongs(own, label, now - self._behind.get(name, now))

    def _set_surface_visible(self, name, visible):
        """Hides a deformed surface that may not be shown, and gives back only what was hidden here."""
        node = bridge_node(name)
        display = None if node is None else node.GetDisplayNode()
        if display is None:
            return
        if not visible and display.GetVisibility():
            display.SetVisibility(0)
            self._hidden.add(node.GetID())
        elif visible and node.GetID() in self._hidden:
            display.SetVisibility(1)
            self._hidden.discard(node.GetID())
