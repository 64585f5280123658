# SPDX-License-Identifier: Apache-2.0
"""Brainshift: a scripted loadable module of 3D Slicer that shows the field of a running `brainshift bridge`.

Research software, no medical device. Written against the sources of Slicer 5.6 to 5.13 and of SlicerOpenIGTLink; it was
tested against a stub of Slicer's classes and not run inside Slicer (docs/slicer.md).

What may be shown, and the transform, are made in BrainshiftLib, which knows nothing of Slicer. Here: nodes and widgets.
"""
from __future__ import annotations


import ctk
import qt
import slicer
import vtk
from BrainshiftLib.colours import FULL_SCALE_MM
from BrainshiftLib.grid import FieldError, check_field, field_from_image, grid_transform
from BrainshiftLib.label import LabelError, Light, Verdict, boot_time, may_be_shown, parse_metadata, parse_state
from BrainshiftLib.scene import FIELD, KNOWN, SD, STATE, TRANSFORM, SceneNodes, bridge_node, field_of
from slicer.ScriptedLoadableModule import (ScriptedLoadableModule, ScriptedLoadableModuleLogic,
                                           ScriptedLoadableModuleTest, ScriptedLoadableModuleWidget)
from slicer.util import VTKObservationMixin

DEFAULT_HOST, DEFAULT_PORT = "localhost", 18945
TICK_MS = 100
LEASE_S = 3.0  # a word of the bridge counts for so long; the bridge speaks every second or oftener
PINNED_MODEL = "pinned_model_id"  # in the module's parameter node, so it is saved with the scene
MISSING = ("The extension SlicerOpenIGTLink is not installed. Install it with View > Extension Manager > SlicerOpenIGTLink, "
           "and start Slicer again.")


class Brainshift(ScriptedLoadableModule):
    def __init__(self, parent):
        ScriptedLoadableModule.__init__(self, parent)
        self.parent.title = "Brainshift"
        self.parent.categories = ["IGT"]
        self.parent.dependencies = []  # OpenIGTLinkIF is looked for when it is needed, to say clearly that it is missing
        self.parent.contributors = ["The brainshift project"]
        self.parent.helpText = (
            "Shows the deformation of a brain that <code>brainshift bridge</code> streams, as a transform of the volumes "
            "and models that you choose. Research software, no medical device. The module was tested against a stub of "
            "Slicer's classes; it was not run inside Slicer by those who wrote it. It needs SlicerOpenIGTLink.")
        self.parent.acknowledgementText = ""


class BrainshiftLogic(ScriptedLoadableModuleLogic, VTKObservationMixin):
    """Follows the bridge's nodes. Every tick() decides anew what may be shown."""

    def __init__(self, clock=boot_time):
        ScriptedLoadableModuleLogic.__init__(self)
        VTKObservationMixin.__init__(self)
        self.verdict = Verdict(Light.RED, "not connected")
        self.state = None            # Label: the bridge's newest word
        self.nodes = SceneNodes()
        self._clock = clock
        self._connector = None
        self._shown = False
        self._forget()

    def _forget(self):
        self.removeObservers()
        self._watched = {}           # name -> node whose changes are heard
        self.state = None
        self._heard_at = None        # when the newest state came
        self._field_arrived = False  # over this connection; False for that of a loaded scene
        self._new_field = False      # arrived and not looked at yet
        self._field = None           # VectorField, checked; None: refused
        self._field_refusal = ""
        self._label = None           # that came with the field
        self._behind_since = None    # since when field and state have been of different updates

    # ---- the bridge

    def connect(self, host=DEFAULT_HOST, port=DEFAULT_PORT):
        """Raises RuntimeError where SlicerOpenIGTLink is missing or the connector does not start."""
        if not hasattr(slicer, "vtkMRMLIGTLConnectorNode"):
            raise RuntimeError(MISSING)
        self.disconnect()
        connector = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLIGTLConnectorNode", "Brainshift bridge")
        connector.SetTypeClient(host, port)
        connector.SetCheckCRC(True)
        connector.SetSaveWithScene(False)
        self._connector = connector
        self._watch()  # nodes that were there before count only once a message has changed them
        self.addObserver(connector, slicer.vtkMRMLIGTLConnectorNode.NewDeviceEvent, self._on_new_node)
        if connector.Start() != 1:
            self.disconnect()
            raise RuntimeError(f"No connection to {host}:{port} could be started.")

    def disconnect(self):
        connector, self._connector = self._connector, None
        self._forget()
        if connector is not None:
            connector.Stop()
            slicer.mrmlScene.RemoveNode(connector)
        self.tick()
        self.nodes.release_surfaces()

    def scene_closed(self):
        """Every node is gone, except singletons."""
        self._connector = None
        self._forget()
        self.nodes.forget()
        self.tick()

    @property
    def connecting(self):
        return self._connector is not None

    @property
    def connected(self):
        return self.connecting and self._connector.GetState() == slicer.vtkMRMLIGTLConnectorNode.StateConnected

    def _watch(self):
        """Observes the bridge's nodes, which may be made or deleted at any time. Returns the names of new ones."""
        new = []
        for name, heard in ((STATE, self._on_state), (FIELD, self._on_field)):
            node, before = bridge_node(name), self._watched.get(name)
            if node is before:
                continue
            if before is not None:
                self.removeObserver(before, vtk.vtkCommand.ModifiedEvent, heard)
            if node is not None:
                self.addObserver(node, vtk.vtkCommand.ModifiedEvent, heard)
                new.append(name)
            if name == FIELD:
                self._field, self._field_arrived, self._new_field = None, False, False
            else:
                self._heard_at = None
            self._watched[name] = node
        return new

    def _on_new_node(self, caller, event):
        """The connector made a node for a device's first message. The change was over before it could be observed."""
        for name in self._watch():
            (self._on_field if name == FIELD else self._on_state)(None, None)

    def _on_state(self, caller, event):
        self._heard_at = self._clock()

    def _on_field(self, caller, event):
        self._field_arrived = self._new_field = True

    # ---- what the user decides

    @property
    def pinned_model(self):
        return self.getParameterNode().GetParameter(PINNED_MODEL) or ""

    def pin(self):
        """The user confirms that the model of the bridge belongs to the patient of this scene."""
        if self.state is None or not self.state.model_id:
            raise RuntimeError("The bridge has not named a model yet.")
        if self.pinned_model and self.pinned_model != self.state.model_id:
            raise RuntimeError(f"This scene belongs to model {self.pinned_model}. Release that one first.")
        self.getParameterNode().SetParameter(PINNED_MODEL, self.state.model_id)
        self.tick()

    def unpin(self):
        self.getParameterNode().SetParameter(PINNED_MODEL, "")
        self.tick()

    def set_followers(self, nodes):
        refused = self.nodes.set_followers(nodes)
        self.tick()
        return refused

    def show_overlay(self, name, wanted):
        """SD or KNOWN over the slices; one at a time."""
        if wanted:
            self.nodes.overlay_wanted = name
        elif self.nodes.overlay_wanted == name:
            self.nodes.overlay_wanted = None
        self.tick()

    # ---- what is shown

    def tick(self):
        """Looks at the newest nodes, and shows or takes away. Never raises for what the bridge sends."""
        if self._connector is not None and slicer.mrmlScene.GetNodeByID(self._connector.GetID()) is None:
            self._connector.Stop()  # its node was deleted: nothing comes any more
            self._connector = None
            self._forget()
        self._watch()
        self.verdict, label = self._judge()
        if self.verdict.show:
            self.nodes.show(self._field, label, self._clock())
        elif self._connector is not None or self._shown:
            self.nodes.take_away()
        self._shown = self.verdict.show
        self._label = label
        return self.verdict

    def at_cursor(self):
        """One line about the place under the mouse cursor, of the field that is shown; else empty."""
        if not self._shown or self._field is None or self._label is None:
            return ""
        return self.nodes.at_cursor(self._field, self._label, self._clock())

    def _judge(self):
        """Verdict, and the label of the field."""
        if not self.connecting:
            return Verdict(Light.RED, "not connected"), None
        if bridge_node(FIELD) is None and self.connected:
            return Verdict(Light.RED, f"there is no volume {FIELD}: none has come, or it was renamed or deleted"), None
        if not self.connected:
            self._heard_at = None
            return Verdict(Light.RED, "no connection to the bridge"), None
        try:
            self.state = None
            if self._heard_at is not None:
                self.state = parse_state(bridge_node(STATE).GetText() or "")
            label = parse_metadata(bridge_node(FIELD).GetAttribute) if self._field_arrived else None
        except LabelError as error:
            return Verdict(Light.RED, str(error)), None
        heard_s = float("inf") if self._heard_at is None else self._clock() - self._heard_at
        verdict = may_be_shown(label, self.state, self.pinned_model, heard_s, LEASE_S, self._behind_s(label))
        if verdict.show:
            self._read_field(bridge_node(FIELD))
            if self._field is None:
                verdict = Verdict(Light.RED, self._field_refusal)
        return verdict, label

    def _behind_s(self, label):
        if label is None or self.state is None or label.sequence == self.state.sequence:
            self._behind_since = None
            return 0.0
        if self._behind_since is None:
            self._behind_since = self._clock()
        return self._clock() - self._behind_since

    def _read_field(self, node):
        if not self._new_field:
            return
        self._new_field, self._field = False, None
        try:
            field = field_of(node)
            check_field(field)
        except FieldError as error:
            self._field_refusal = str(error)
        else:
            self._field = field


class BrainshiftWidget(ScriptedLoadableModuleWidget, VTKObservationMixin):
    BACKGROUND = {Light.GREEN: "#1b6e2c", Light.AMBER: "#8a6100", Light.RED: "#a01818"}

    def __init__(self, parent=None):
        ScriptedLoadableModuleWidget.__init__(self, parent)
        VTKObservationMixin.__init__(self)
        self.logic = None

    def setup(self):
        ScriptedLoadableModuleWidget.setup(self)
        self.logic = BrainshiftLogic()
        self.layout.addWidget(qt.QLabel("Research software, no medical device."))
        self._setup_connection()
        self._setup_display()
        scene = slicer.mrmlScene
        self.addObserver(scene, scene.EndImportEvent, lambda *_: self.logic.nodes.detach_strangers())
        self.addObserver(scene, scene.EndCloseEvent, lambda *_: self.logic.scene_closed())
        self.timer = qt.QTimer()
        self.timer.setInterval(TICK_MS)
        self.timer.connect("timeout()", self.on_tick)
        self.timer.start()
        self.on_tick()

    def _form(self, title):
        section = ctk.ctkCollapsibleButton()
        section.text = title
        self.layout.addWidget(section)
        return qt.QFormLayout(section)

    def _button(self, text, clicked):
        button = qt.QPushButton(text)
        button.connect("clicked()", clicked)
        return button

    @staticmethod
    def _plain(label):
        """What others sent is shown as it is: no markup, and no escapes of it."""
        label.setTextFormat(qt.Qt.PlainText)

    def _setup_connection(self):
        form = self._form("Bridge")
        self.host = qt.QLineEdit(DEFAULT_HOST)
        self.port = qt.QSpinBox()
        self.port.setRange(1, 65535)
        self.port.setValue(DEFAULT_PORT)
        self.connect_button = self._button("Connect", self.on_connect)
        self.patient = qt.QLabel("")
        self.pin_button = self._button("This is the model of my patient", self.on_pin)
        self.unpin_button = self._button("Release the model", self.on_unpin)
        self._plain(self.patient)
        for label, widget in (("Host", self.host), ("Port", self.port), ("", self.connect_button), ("Model", self.patient),
                              ("", self.pin_button), ("", self.unpin_button)):
            form.addRow(label, widget)

    def _setup_display(self):
        form = self._form("Field")
        self.light = qt.QLabel("")
        self.light.wordWrap = True
        self.details = qt.QLabel("")
        self._plain(self.light)
        self._plain(self.details)
        self.under = qt.QLabel("")
        self.under.wordWrap = True
        self._plain(self.under)
        self.followers = slicer.qMRMLCheckableNodeComboBox()
        self.followers.nodeTypes = ["vtkMRMLScalarVolumeNode", "vtkMRMLLabelMapVolumeNode", "vtkMRMLModelNode",
                                    "vtkMRMLSegmentationNode", "vtkMRMLMarkupsNode"]
        self.followers.setMRMLScene(slicer.mrmlScene)
        self.followers.connect("checkedNodesChanged()", self.on_followers)
        self.sd = qt.QCheckBox(f"Standard deviation over the slices, 0 to {FULL_SCALE_MM:g} mm")
        self.sd.connect("toggled(bool)", self.on_sd)
        self.known = qt.QCheckBox("What the data know over the slices: dark 1, yellow 0 (a guess)")
        self.known.connect("toggled(bool)", self.on_known)
        for label, widget in (("", self.light), ("", self.details), ("Under the cursor", self.under),
                              ("Moves", self.followers), ("", self.sd), ("", self.known)):
            form.addRow(label, widget)

    def cleanup(self):
        self.timer.stop()
        self.removeObservers()
        self.logic.disconnect()

    def on_connect(self):
        try:
            if self.logic.connecting:
                self.logic.disconnect()
            else:
                self.logic.connect(self.host.text, self.port.value)
        except RuntimeError as error:
            slicer.util.errorDisplay(str(error))
        self.on_tick()

    def on_pin(self):
        try:
            self.logic.pin()
        except RuntimeError as error:
            slicer.util.errorDisplay(str(error))

    def on_unpin(self):
        self.logic.unpin()

    def on_followers(self):
        refused = self.logic.set_followers(self.followers.checkedNodes())
        if refused:
            slicer.util.errorDisplay("\n".join(refused))

    def on_sd(self, wanted):
        self.logic.show_overlay(SD, wanted)
        if wanted:
            self.known.checked = False

    def on_known(self, wanted):
        self.logic.show_overlay(KNOWN, wanted)
        if wanted:
            self.sd.checked = False

    def on_tick(self):
        verdict, state = self.logic.tick(), self.logic.state
        self.connect_button.text = "Disconnect" if self.logic.connecting else "Connect"
        model = self.logic.pinned_model if state is None else f"{state.case_id}, {state.model_id}"
        self.patient.text = model
        words = "Shown" if verdict.show else "NOT SHOWN"
        self.light.text = f"{words}: {verdict.reason}" if verdict.reason else words
        self.light.setStyleSheet(f"color: white; padding: 6px; background: {self.BACKGROUND[verdict.light]}")
        self.details.text = describe(state, self.logic.nodes.largest_mm)
        self.under.text = self.logic.at_cursor()


def describe(state, largest_mm):
    """Quality, age and size of the field, one line each."""
    if state is None:
        return ""
    lines = [f"quality {state.quality}" + (f" ({state.flags})" if state.flags else ""),
             ("RECORDED, " if state.recorded else "") + f"{state.method}, {state.boundary}",
             "age of its data not known" if state.age_ms is None else f"age of its data {state.age_ms / 1000.0:.1f} s"]
    if largest_mm is not None:
        lines.append(f"largest motion {largest_mm:.1f} mm")
        if state.grid_error_mm is not None:
            lines.append(f"error of the grid at most {state.grid_error_mm:.2f} mm")
        if state.fade_mm:
            lines.append(f"fades to nothing over the outer {state.fade_mm:.0f} mm of the grid")
        if not state.has_sd:
            lines.append("came without standard deviations")
        if not state.has_known:
            lines.append("came without word of what the data know")
    return "\n".join(lines)


class BrainshiftTest(ScriptedLoadableModuleTest):
    """For a run inside Slicer: a field of known shape moves a point by Slicer's own transform node."""

    def runTest(self):
        slicer.mrmlScene.Clear()
        self.test_a_transform_node_moves_points_to_parent()

    def test_a_transform_node_moves_points_to_parent(self):
        image = vtk.vtkImageData()
        image.SetDimensions(5, 5, 5)
        image.AllocateScalars(vtk.VTK_FLOAT, 3)
        for index in range(image.GetNumberOfPoints()):
            place = (index % 5, index // 5 % 5, index // 25)
            inside = all(0 < at < 4 for at in place)
            image.GetPointData().GetScalars().SetTuple3(index, 3.0 if inside else 0.0, 0.0, 0.0)
        field = field_from_image(image, [[10, 0, 0, -20], [0, 10, 0, -20], [0, 0, 10, -20], [0, 0, 0, 1]])
        node = slicer.mrmlScene.AddNewNodeByClass("vtkMRMLGridTransformNode", TRANSFORM)
        node.SetAndObserveTransformToParent(grid_transform(field, slicer.vtkOrientedGridTransform))
        moved = node.GetTransformToParent().TransformPoint(0.0, 0.0, 0.0)
        self.assertAlmostEqual(moved[0], 3.0, places=3)
        self.delayDisplay("Test passed")
