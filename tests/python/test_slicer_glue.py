# SPDX-License-Identifier: GPL-3.0-or-later
"""The Slicer module's nodes and widgets, against a stand-in for Slicer (slicer_stub.py). No Slicer runs here."""
import importlib
import json
import sys
import types

import numpy as np
import pytest
import slicer_paths
import slicer_stub
from slicer_fields import image_of, label_values, metadata, ras_grid, sampled, smooth
from slicer_stub import CLASSES

FIELD, SD, KNOWN, STATE = "brainshift_u", "brainshift_sd", "brainshift_known", "brainshift_state"
KINDS = {FIELD: "vtkMRMLVectorVolumeNode", SD: "vtkMRMLScalarVolumeNode", KNOWN: "vtkMRMLScalarVolumeNode",
         STATE: "vtkMRMLTextNode",
         "brainshift_tumour": "vtkMRMLModelNode", "brainshift_cortex": "vtkMRMLModelNode",
         "brainshift_septa": "vtkMRMLModelNode"}


class Room:
    """Slicer with the module, its connector, and a bridge that speaks through it."""

    def __init__(self, pinned="m1"):
        self.slicer = slicer_stub.install()
        self.module = importlib.import_module("Brainshift")
        self.now = 100.0
        self.logic = self.module.BrainshiftLogic(clock=lambda: self.now)
        self.scene = self.slicer.mrmlScene
        if pinned:
            self.logic.getParameterNode().SetParameter("pinned_model_id", pinned)

    def connect(self):
        self.logic.connect()
        self.connector.state = self.connector.StateConnected

    @property
    def connector(self):
        return next(node for node in self.scene.nodes if node.IsA("vtkMRMLIGTLConnectorNode"))

    def node(self, name):
        return self.scene.GetFirstNode(name, KINDS[name])

    def receive(self, name, set_content, values):
        """What SlicerOpenIGTLink does with a message: content and attributes, then one Modified or, of a new node, the
        connector's event."""
        node, new = self.node(name), False
        if node is None:
            node, new = self.scene.AddNewNodeByClass(KINDS[name], name), True
        set_content(node)
        for key, value in values.items():
            node.SetAttribute("OpenIGTLink." + key, value)
        if new:
            self.connector.InvokeEvent(self.connector.NewDeviceEvent)
        else:
            node.Modified()

    def send_field(self, scale=1.0, **changes):
        matrix, dims = ras_grid(8.0)

        def content(node):
            node.image = image_of(scale * sampled(matrix, dims))
            for row in range(4):
                for column in range(4):
                    node.matrix.SetElement(row, column, matrix[row, column])
        self.receive(FIELD, content, metadata(**changes))

    def send_state(self, **changes):
        def content(node):
            node.text = json.dumps(label_values(**changes))
        self.receive(STATE, content, metadata(**changes))

    def send(self, **changes):
        """An update, as the bridge sends it."""
        self.send_field(**changes)
        for name in (SD, KNOWN, "brainshift_tumour", "brainshift_cortex", "brainshift_septa"):
            self.receive(name, lambda node: None, metadata(**changes))
        self.send_state(**changes)

    def volume(self, name="MRI", kind="vtkMRMLScalarVolumeNode"):
        return self.scene.AddNewNodeByClass(kind, name)

    @property
    def transform(self):
        return self.scene.GetFirstNode("brainshift_transform", "vtkMRMLGridTransformNode")


@pytest.fixture
def room():
    room = Room()
    room.connect()
    return room


@pytest.fixture
def shown(room):
    """With a field, and a volume that follows it."""
    room.mri = room.volume()
    room.logic.set_followers([room.mri])
    room.send()
    assert room.logic.tick().show
    return room


# ---- the bridge

def test_a_missing_extension_is_named():
    slicer_stub.install(with_openigtlink=False)
    logic = importlib.import_module("Brainshift").BrainshiftLogic()
    with pytest.raises(RuntimeError, match="SlicerOpenIGTLink is not installed"):
        logic.connect()
    assert not logic.tick().show


def test_the_connector_is_a_client_that_checks_checksums_and_is_not_saved(room):
    assert room.connector.log == [("client", "localhost", 18945), ("crc", True), "start"]
    assert room.connector.GetSaveWithScene() == 0


def test_a_connector_that_does_not_start_leaves_nothing_behind(monkeypatch):
    room = Room()
    monkeypatch.setattr(slicer_stub.vtkMRMLIGTLConnectorNode, "starts", False)
    with pytest.raises(RuntimeError, match="localhost:18945"):
        room.logic.connect()
    assert room.scene.nodes == [] and not room.logic.connecting


def test_connecting_again_ends_the_first_connection(room):
    first = room.connector
    room.connect()
    assert first.log[-1] == "stop" and first not in room.scene.nodes and room.connector is not first


# ---- a field that may be shown

def test_the_transform_is_set_to_parent_before_a_node_follows_it(shown):
    (transform,) = shown.transform.log
    assert shown.mri.GetTransformNodeID() == shown.transform.GetID()
    point = np.array([8.0, -8.0, 16.0])  # a node of the grid
    assert np.array(transform.TransformPoint(*point)) == pytest.approx(point + smooth(point), abs=1e-4)
    assert shown.logic.nodes.largest_mm == pytest.approx(np.linalg.norm([3.0, -5.0, 7.0]), rel=1e-5)


def test_the_first_message_of_all_suffices(room):
    """The connector makes the node and has changed it before anybody can observe it."""
    room.send()
    assert room.logic.tick().show


def test_a_new_update_replaces_the_transform_and_an_old_one_is_not_built_again(shown):
    shown.logic.tick()
    shown.logic.tick()
    assert len(shown.transform.log) == 1
    shown.send_field(scale=0.5, sequence=8)
    shown.send_state(sequence=8)
    assert shown.logic.tick().show
    before, after = shown.transform.log
    assert after.TransformPoint(0, 0, 0)[0] == pytest.approx(before.TransformPoint(0, 0, 0)[0] / 2.0, rel=1e-5)
    assert shown.mri.GetTransformNodeID() == shown.transform.GetID()


def test_while_a_field_is_on_its_way_behind_its_state_the_one_before_stays(shown):
    shown.send_state(sequence=8)
    assert "on its way" in shown.logic.tick().reason and shown.mri.GetTransformNodeID() is not None
    shown.now += 0.4
    shown.send_state(sequence=9)
    assert shown.logic.tick().show
    shown.now += 0.2
    assert "update 7, the bridge is at 9" in shown.logic.tick().reason, "it is late, whatever came meanwhile"
    assert shown.mri.GetTransformNodeID() is None
    shown.send_field(sequence=9)
    assert shown.logic.tick().reason == "" and shown.mri.GetTransformNodeID() is not None


# ---- a field that may not

AGAINST = [dict(currency="stale", reason="silent"), dict(currency="none", reason="ended"), dict(quality="unusable"),
           dict(quality="none"), dict(blank=True, reason="goodbye"), dict(currency="degraded"), dict(session_id=0),
           dict(model_id="m2"), dict(direction="resampling")]


@pytest.mark.parametrize("change", AGAINST)
def test_a_word_against_it_removes_the_transform(shown, change):
    shown.send_state(**change)
    verdict = shown.logic.tick()
    assert not verdict.show and verdict.reason
    assert shown.transform.log[-1] is None and shown.mri.GetTransformNodeID() is None


@pytest.mark.parametrize("change", AGAINST)
def test_what_was_never_right_was_never_shown(room, change):
    mri = room.volume()
    room.logic.set_followers([mri])
    room.send(**change)
    assert not room.logic.tick().show
    assert room.transform is None and mri.GetTransformNodeID() is None


def test_silence_removes_it(shown):
    shown.now += 2.9
    assert shown.logic.tick().show
    shown.now += 0.2
    assert "nothing was heard" in shown.logic.tick().reason
    assert shown.transform.log[-1] is None and shown.mri.GetTransformNodeID() is None
    shown.send_state()  # the same words again: the bridge lives
    assert shown.logic.tick().show and shown.mri.GetTransformNodeID() == shown.transform.GetID()


def test_the_end_of_the_connection_removes_it_at_once(shown):
    shown.connector.state = shown.connector.StateWaitConnection
    assert "no connection" in shown.logic.tick().reason
    assert shown.mri.GetTransformNodeID() is None
    shown.connector.state = shown.connector.StateConnected
    assert not shown.logic.tick().show, "what was heard before counts for nothing"
    shown.send_state()
    assert shown.logic.tick().show


def test_disconnecting_removes_it(shown):
    shown.logic.disconnect()
    assert shown.logic.verdict.reason == "not connected"
    assert shown.transform.log[-1] is None and shown.mri.GetTransformNodeID() is None


def test_a_blank_field_is_not_shown_whatever_is_said_of_it(shown):
    shown.send_field(scale=0.0, sequence=8)
    shown.send_state(sequence=8)
    assert "blank" in shown.logic.tick().reason
    assert shown.transform.log[-1] is None and shown.mri.GetTransformNodeID() is None
    assert "blank" in shown.logic.tick().reason, "still, when nothing new has come"


def test_metadata_of_version_1_shows_nothing(room):
    room.send_field()
    for key in label_values():
        room.node(FIELD)._attributes.pop("OpenIGTLink." + key)
    room.send_state()
    assert "version 2" in room.logic.tick().reason


@pytest.mark.parametrize("text", ["", "{}", "[]", "nonsense"])
def test_a_state_without_sense_removes_it_and_raises_nothing(shown, text):
    shown.node(STATE).text = text
    shown.node(STATE).Modified()
    assert not shown.logic.tick().show
    assert shown.transform.log[-1] is None


def test_a_deleted_node_removes_it(shown):
    shown.scene.RemoveNode(shown.node(FIELD))
    assert not shown.logic.tick().show and shown.transform.log[-1] is None
    shown.send()
    assert shown.logic.tick().show
    shown.scene.RemoveNode(shown.node(STATE))
    assert not shown.logic.tick().show


def test_a_renamed_volume_is_named(shown):
    shown.node(FIELD).SetName("mine")
    verdict = shown.logic.tick()
    assert not verdict.show and "no volume brainshift_u" in verdict.reason and "renamed" in verdict.reason


def test_a_deleted_connector_ends_the_connection(shown):
    assert shown.logic.connecting
    shown.scene.RemoveNode(shown.logic._connector)
    assert shown.logic.tick().reason == "not connected"
    assert not shown.logic.connecting and not shown.logic.verdict.show


def test_a_deleted_transform_is_made_again(shown):
    shown.scene.RemoveNode(shown.transform)
    assert shown.logic.tick().show and shown.transform.log[-1] is not None


# ---- the patient

def test_nothing_is_shown_before_the_user_has_confirmed_the_model():
    room = Room(pinned="")
    with pytest.raises(RuntimeError, match="not named"):
        room.logic.pin()
    room.connect()
    room.send()
    assert "confirm that model m1" in room.logic.tick().reason and room.transform is None
    room.logic.pin()
    assert room.logic.verdict.show
    assert room.logic.getParameterNode().GetParameter("pinned_model_id") == "m1", "it is saved with the scene"


def test_another_patients_model_is_not_shown_and_not_taken_by_accident(room):
    room.send(model_id="m2")
    assert "m2" in room.logic.tick().reason
    with pytest.raises(RuntimeError, match="belongs to model m1"):
        room.logic.pin()
    room.logic.unpin()
    assert not room.logic.verdict.show
    room.logic.pin()
    assert room.logic.verdict.show


# ---- scenes

def test_a_field_of_a_loaded_scene_is_not_shown():
    room = Room()
    for name in (FIELD, STATE):  # as they were saved, with a good word on them
        room.scene.AddNewNodeByClass(KINDS[name], name)
    room.scene.nodes[1].text = json.dumps(label_values())
    for key, value in metadata().items():
        room.scene.nodes[0].SetAttribute("OpenIGTLink." + key, value)
    room.logic.tick()
    room.connect()
    assert not room.logic.tick().show and room.transform is None
    room.send_state()
    assert not room.logic.tick().show, "the state is new, the field is not"
    room.send_field()
    assert room.logic.tick().show


def test_the_transform_is_not_saved_and_its_id_is_nobody_elses(shown):
    assert shown.transform.GetSaveWithScene() == 0
    assert shown.transform.GetID() == "vtkMRMLGridTransformNodeBrainshift"


def test_nodes_of_a_loaded_scene_do_not_follow_unless_they_are_chosen(room):
    saved = room.volume("saved")
    saved.SetAndObserveTransformNodeID("vtkMRMLGridTransformNodeBrainshift")
    room.send()
    assert room.logic.tick().show and saved.GetTransformNodeID() is None
    loaded = room.volume("loaded")
    loaded.SetAndObserveTransformNodeID("vtkMRMLGridTransformNodeBrainshift")
    room.logic.nodes.detach_strangers()
    assert loaded.GetTransformNodeID() is None


def test_a_closed_scene_leaves_no_field_to_the_next_one(shown):
    transform = shown.transform
    shown.scene.close()
    assert shown.transform is transform, "Slicer keeps singletons"
    shown.logic.scene_closed()
    assert transform.log[-1] is None and shown.scene.nodes == []
    assert not shown.logic.connecting and not shown.logic.tick().show


# ---- what follows

def test_what_no_longer_follows_is_released(shown):
    other = shown.volume("CT")
    shown.logic.set_followers([other])
    assert shown.mri.GetTransformNodeID() is None and other.GetTransformNodeID() == shown.transform.GetID()
    shown.logic.set_followers([])
    assert other.GetTransformNodeID() is None


def test_what_is_deformed_already_or_lies_elsewhere_is_refused(shown):
    elsewhere = shown.volume("registered")
    elsewhere.SetAndObserveTransformNodeID("vtkMRMLLinearTransformNode1")
    refused = shown.logic.set_followers([shown.node("brainshift_tumour"), elsewhere, shown.mri])
    assert len(refused) == 2 and "deformed already" in refused[0] and "another transform" in refused[1]
    assert elsewhere.GetTransformNodeID() == "vtkMRMLLinearTransformNode1"
    assert shown.mri.GetTransformNodeID() == shown.transform.GetID()


def test_a_node_that_the_user_moved_elsewhere_is_left_there(shown):
    shown.mri.SetAndObserveTransformNodeID("vtkMRMLLinearTransformNode1")
    shown.logic.tick()
    shown.send_state(currency="stale")
    shown.logic.tick()
    assert shown.mri.GetTransformNodeID() == "vtkMRMLLinearTransformNode1"


def test_a_deleted_follower_disturbs_nothing(shown):
    shown.scene.RemoveNode(shown.mri)
    assert shown.logic.tick().show
    shown.send_state(currency="stale")
    assert not shown.logic.tick().show


# ---- under the cursor

def test_the_place_under_the_cursor_says_where_it_was_and_how_sure_that_is(shown):
    crosshair = shown.scene.AddNewNodeByClass("vtkMRMLCrosshairNode", "Crosshair")
    assert shown.logic.at_cursor() == "", "over no slice"
    matrix, dims = ras_grid(8.0)
    was = np.array([8.0, -16.0, 0.0])  # a node of the grid
    crosshair.cursor = list(was + smooth(was))
    moved = np.linalg.norm(smooth(was))
    assert shown.logic.at_cursor() == f"R 8.0, A -16.0, S 0.0 mm of the MRI moved {moved:.1f} mm", "sd and known came empty"

    def constant(value):
        def content(node):
            node.image = image_of(np.full((*reversed(dims), 1), value, np.float32))
            for row in range(4):
                for column in range(4):
                    node.matrix.SetElement(row, column, matrix[row, column])
        return content
    shown.receive(SD, constant(0.4), metadata())
    shown.receive(KNOWN, constant(0.75), metadata())
    assert shown.logic.at_cursor().endswith(f"moved {moved:.1f} \u00b1 0.4 mm, 75 % known by the data")
    shown.receive(SD, constant(0.4), metadata(sequence=5))
    assert "\u00b1" in shown.logic.at_cursor(), "that of the update is on its way"
    shown.now += 0.6
    assert "\u00b1" not in shown.logic.at_cursor(), "of another update"
    crosshair.cursor = [300.0, 0.0, 0.0]
    assert shown.logic.at_cursor() == "", "outside of the field"
    crosshair.cursor = list(was)
    shown.send_state(currency="stale")
    shown.logic.tick()
    assert shown.logic.at_cursor() == "", "a field that is taken away says nothing"


# ---- sd and surfaces

def test_the_sd_lies_over_the_slices_only_with_the_field(shown):
    assert shown.slicer.layers == []
    shown.logic.show_overlay(SD, True)
    shown.logic.tick()
    (layer,) = shown.slicer.layers
    assert layer["foreground"] is shown.node(SD) and 0.0 < layer["foregroundOpacity"] < 1.0
    calls = shown.node(SD).GetDisplayNode().calls
    assert calls["auto"] == 0 and calls["window"] == (0.0, 4.0) and calls["lower"] > 0.0 and calls["threshold"] == 1
    colours = shown.scene.GetNodeByID(calls["colour"])
    assert len(colours.colours) == colours.count == 256 and colours.GetSaveWithScene() == 0
    shown.send_state(currency="stale")
    shown.logic.tick()
    assert shown.slicer.layers[-1] == {"foreground": None} and len(shown.slicer.layers) == 2


def test_the_sd_of_another_update_is_not_shown(shown):
    shown.logic.show_overlay(SD, True)
    shown.send_field(sequence=8)
    shown.send_state(sequence=8)
    assert shown.logic.tick().show
    assert len(shown.slicer.layers) == 1, "that of the update is on its way"
    shown.now += 0.6
    assert shown.logic.tick().show
    assert shown.slicer.layers[-1] == {"foreground": None}


def test_deviations_that_nobody_sent_are_not_shown_as_certainty(shown):
    shown.logic.show_overlay(SD, True)
    shown.send(sequence=8, has_sd=False)
    assert shown.logic.tick().show and shown.slicer.layers[-1] == {"foreground": None}


def test_what_is_known_lies_over_the_slices_in_place_of_the_sd_and_a_guess_is_drawn(shown):
    shown.logic.show_overlay(SD, True)
    shown.logic.show_overlay(KNOWN, True)
    assert shown.slicer.layers[-1]["foreground"] is shown.node(KNOWN)
    calls = shown.node(KNOWN).GetDisplayNode().calls
    assert calls["window"] == (0.0, 1.0) and calls["threshold"] == 0
    colours = shown.scene.GetNodeByID(calls["colour"]).colours
    assert colours[0][1:4] > colours[255][1:4] and colours[255][0] == "1.00"
    shown.logic.show_overlay(SD, False)  # its box was cleared
    assert shown.slicer.layers[-1]["foreground"] is shown.node(KNOWN)
    shown.send(sequence=8, has_known=False)
    assert shown.logic.tick().show and shown.slicer.layers[-1] == {"foreground": None}


def test_one_box_clears_the_other(panel):
    panel.widget.sd.checked = True
    panel.widget.on_known(True)
    assert panel.widget.sd.checked is False and panel.logic.nodes.overlay_wanted == KNOWN
    panel.widget.on_known(False)
    assert panel.logic.nodes.overlay_wanted is None


def test_surfaces_are_hidden_with_the_field_and_come_back_with_it(shown):
    tumour, cortex = (shown.node(f"brainshift_{name}").GetDisplayNode() for name in ("tumour", "cortex"))
    cortex.SetVisibility(0)  # the user's wish
    shown.logic.tick()
    shown.send_state(currency="stale")
    shown.logic.tick()
    assert (tumour.GetVisibility(), cortex.GetVisibility()) == (0, 0)
    shown.send_state()
    shown.logic.tick()
    assert (tumour.GetVisibility(), cortex.GetVisibility()) == (1, 0)
    shown.receive("brainshift_tumour", lambda node: None, metadata(sequence=6))
    shown.logic.tick()
    assert tumour.GetVisibility() == 1, "that of the update may be on its way"
    shown.now += 0.6
    shown.logic.tick()
    assert tumour.GetVisibility() == 0, "a surface of another update"


def test_after_the_end_of_a_connection_the_surfaces_are_the_users(shown):
    tumour = shown.node("brainshift_tumour").GetDisplayNode()
    shown.logic.disconnect()
    assert tumour.GetVisibility() == 0
    tumour.SetVisibility(1)
    shown.logic.tick()
    assert tumour.GetVisibility() == 1


# ---- the panel

@pytest.fixture
def panel():
    room = Room(pinned="")
    room.widget = room.module.BrainshiftWidget()
    room.widget.setup()
    room.logic = room.widget.logic
    room.logic._clock = lambda: room.now
    return room


def test_the_panel_goes_from_red_to_green_and_back(panel):
    widget, tick = panel.widget, panel.widget.timer.slot
    assert widget.timer.running and widget.timer.interval <= 200
    assert widget.light.text == "NOT SHOWN: not connected" and "#a01818" in widget.light.style
    widget.connect_button.connected["clicked()"]()
    panel.connector.state = panel.connector.StateConnected
    mri = panel.volume()
    widget.followers.checked = [mri]
    widget.followers.connected["checkedNodesChanged()"]()
    panel.send()
    tick()
    assert "confirm that model m1" in widget.light.text and "c1, m1" in widget.patient.text
    widget.pin_button.connected["clicked()"]()
    tick()
    assert widget.light.text == "Shown" and "#1b6e2c" in widget.light.style
    assert "quality good" in widget.details.text and "largest motion 9.1 mm" in widget.details.text
    assert "age of its data 0.0 s" in widget.details.text and "0.10 mm" in widget.details.text
    panel.send_state(quality="caution", flags="few_data", reason="few data")
    tick()
    assert widget.light.text == "Shown: few data" and "#8a6100" in widget.light.style and "few_data" in widget.details.text
    panel.now += 10.0
    tick()
    assert widget.light.text.startswith("NOT SHOWN: ") and "#a01818" in widget.light.style
    assert mri.GetTransformNodeID() is None
    widget.connect_button.connected["clicked()"]()
    assert not panel.logic.connecting and widget.connect_button.text == "Connect"


def test_the_panel_tells_errors_instead_of_raising_them(panel):
    panel.widget.pin_button.connected["clicked()"]()
    assert "not named" in panel.slicer.errors[-1]
    volume = panel.volume("brainshift_sd")
    panel.widget.followers.checked = [volume]
    panel.widget.on_followers()
    assert "deformed already" in panel.slicer.errors[-1]


def test_the_modules_own_test_finds_every_name(panel):
    module = sys.modules[type(panel.widget).__module__]
    own = module.BrainshiftTest()
    own.runTest()
    assert own.said == "Test passed"


def test_text_from_the_bridge_is_no_markup(panel):
    panel.connect()
    panel.send(currency="stale", reason="<img src=x>", model_id="m1")
    panel.logic.getParameterNode().SetParameter("pinned_model_id", "m1")
    panel.widget.on_tick()
    assert "<img" in panel.widget.light.text and panel.widget.light.format == "plain"


def test_the_panel_that_is_taken_down_takes_the_field_with_it(panel):
    panel.connect()
    mri = panel.volume()
    panel.logic.set_followers([mri])
    panel.send()
    panel.logic.tick()
    panel.logic.pin()
    assert mri.GetTransformNodeID() is not None
    panel.widget.cleanup()
    assert mri.GetTransformNodeID() is None and not panel.widget.timer.running


def test_a_scene_that_is_loaded_or_closed_is_noticed(panel):
    panel.connect()
    panel.send()
    panel.logic.tick()
    panel.logic.pin()
    loaded = panel.volume()
    loaded.SetAndObserveTransformNodeID(panel.transform.GetID())
    panel.scene.InvokeEvent(panel.scene.EndImportEvent)
    assert loaded.GetTransformNodeID() is None
    panel.scene.close()
    assert panel.scene.nodes == []
    panel.widget.on_tick()
    assert panel.widget.light.text == "NOT SHOWN: not connected"


def test_the_module_says_what_it_is(room):
    parent = types.SimpleNamespace()
    room.module.Brainshift(parent)
    assert parent.title == "Brainshift"
    assert "no medical device" in parent.helpText and "not run inside Slicer" in parent.helpText


def test_the_stand_in_has_only_classes_that_the_module_names():
    text = (slicer_paths.MODULE / "Brainshift.py").read_text()
    text += (slicer_paths.MODULE / "BrainshiftLib" / "scene.py").read_text()
    assert all(name in text for name in CLASSES)
