# SPDX-License-Identifier: GPL-3.0-or-later
"""A stand-in for `slicer`, `qt` and `ctk`: as much of them as the module Brainshift calls, and nothing else.

It is no Slicer. It shows the order of calls and what the nodes hold afterwards. A name that is not here raises
AttributeError, so the stub is also the list of what the module needs: each class names the header that has the methods.
`vtk` is the real one.
"""
import sys
import types
import unittest

import vtk

MODIFIED = "ModifiedEvent"


class Observed:
    """vtkObject"""

    def __init__(self):
        self._observers = {}
        self._tags = 0

    def AddObserver(self, event, callback, priority=0.0):
        self._tags += 1
        self._observers[self._tags] = (event, callback)
        return self._tags

    def RemoveObserver(self, tag):
        del self._observers[tag]

    def InvokeEvent(self, event):
        for observed, callback in list(self._observers.values()):
            if observed == event:
                callback(self, event)

    def Modified(self):
        self.InvokeEvent(vtk.vtkCommand.ModifiedEvent)


class Node(Observed):
    """vtkMRMLNode.h"""

    bases = ()

    def __init__(self):
        super().__init__()
        self._name, self._id, self._attributes, self._save, self._singleton = "", None, {}, 1, None

    def GetName(self):
        return self._name

    def SetName(self, name):
        self._name = name

    def GetID(self):
        return self._id

    def GetAttribute(self, name):
        return self._attributes.get(name)

    def SetAttribute(self, name, value):
        self._attributes[name] = value

    def SetSaveWithScene(self, save):
        self._save = int(save)

    def GetSaveWithScene(self):
        return self._save

    def SetSingletonTag(self, tag):
        self._singleton = tag

    def IsA(self, name):
        return name in [cls.__name__ for cls in type(self).__mro__]


class vtkMRMLTransformableNode(Node):
    def __init__(self):
        super().__init__()
        self._transform_id = None
        self._display = Display()

    def GetTransformNodeID(self):
        return self._transform_id

    def SetAndObserveTransformNodeID(self, node_id):
        self._transform_id = node_id

    def GetDisplayNode(self):  # vtkMRMLDisplayableNode.h
        return self._display


class Display:
    """vtkMRMLDisplayNode.h, vtkMRMLScalarVolumeDisplayNode.h"""

    def __init__(self):
        self._visible = 1
        self.calls = {}

    def GetVisibility(self):
        return self._visible

    def SetVisibility(self, visible):
        self._visible = visible

    def SetAndObserveColorNodeID(self, node_id):
        self.calls["colour"] = node_id

    def SetAutoWindowLevel(self, auto):
        self.calls["auto"] = auto

    def SetWindowLevelMinMax(self, low, high):
        self.calls["window"] = (low, high)

    def SetLowerThreshold(self, value):
        self.calls["lower"] = value

    def SetApplyThreshold(self, apply):
        self.calls["threshold"] = apply


class vtkMRMLScalarVolumeNode(vtkMRMLTransformableNode):
    """vtkMRMLVolumeNode.h"""

    def __init__(self):
        super().__init__()
        self.image, self.matrix = None, vtk.vtkMatrix4x4()

    def GetImageData(self):
        return self.image

    def GetIJKToRASMatrix(self, matrix):
        matrix.DeepCopy(self.matrix)


class vtkMRMLVectorVolumeNode(vtkMRMLScalarVolumeNode):
    pass


class vtkMRMLModelNode(vtkMRMLTransformableNode):
    pass


class vtkMRMLTextNode(Node):
    def __init__(self):
        super().__init__()
        self.text = ""

    def GetText(self):
        return self.text


class vtkMRMLGridTransformNode(vtkMRMLTransformableNode):
    """vtkMRMLTransformNode.h. `log` has every transform that was set, None for its removal."""

    def __init__(self):
        super().__init__()
        self.log = []

    def SetAndObserveTransformToParent(self, transform):
        assert transform is None or transform.IsA("vtkAbstractTransform")
        self.log.append(transform)

    def GetTransformToParent(self):
        return self.log[-1]


class vtkMRMLCrosshairNode(Node):
    """vtkMRMLCrosshairNode.h. `cursor` is None when the mouse is over no view."""

    def __init__(self):
        super().__init__()
        self.cursor = None

    def GetCursorPositionRAS(self, place):
        if self.cursor is not None:
            place[:] = self.cursor
        return self.cursor is not None


class vtkMRMLColorTableNode(Node):
    def __init__(self):
        super().__init__()
        self.count, self.colours, self.user = 0, {}, False

    def SetTypeToUser(self):
        self.user = True

    def SetNumberOfColors(self, count):
        assert self.user, "colours of a node of another type cannot be set"
        self.count = count

    def SetColor(self, index, name, red, green, blue, alpha):
        assert 0 <= index < self.count
        self.colours[index] = (name, red, green, blue, alpha)


class vtkMRMLIGTLConnectorNode(Node):
    """OpenIGTLinkIF/MRML/vtkMRMLIGTLConnectorNode.h of SlicerOpenIGTLink"""

    StateOff, StateWaitConnection, StateConnected = 0, 1, 2
    NewDeviceEvent = 118949
    starts = True  # whether Start() succeeds

    def __init__(self):
        super().__init__()
        self.state, self.log = self.StateOff, []

    def SetTypeClient(self, host, port):
        self.log.append(("client", host, port))

    def SetCheckCRC(self, check):
        self.log.append(("crc", check))

    def Start(self):
        self.log.append("start")
        self.state = self.StateWaitConnection
        return 1 if self.starts else 0

    def Stop(self):
        self.log.append("stop")
        self.state = self.StateOff
        return 1

    def GetState(self):
        return self.state


CLASSES = {cls.__name__: cls for cls in (vtkMRMLScalarVolumeNode, vtkMRMLVectorVolumeNode, vtkMRMLModelNode, vtkMRMLTextNode,
                                         vtkMRMLGridTransformNode, vtkMRMLColorTableNode, vtkMRMLCrosshairNode,
                                         vtkMRMLIGTLConnectorNode)}


class Scene(Observed):
    """vtkMRMLScene.h"""

    EndImportEvent, EndCloseEvent = 66052, 66050  # any two numbers

    def __init__(self):
        super().__init__()
        self.nodes = []

    def AddNode(self, node):
        if node._singleton is not None:
            node._id = type(node).__name__ + node._singleton
            for there in self.nodes:
                if there._id == node._id:
                    return there
        else:
            node._id = f"{type(node).__name__}{1 + sum(type(other) is type(node) for other in self.nodes)}"
        self.nodes.append(node)
        return node

    def AddNewNodeByClass(self, name, called=""):
        node = CLASSES[name]()
        node.SetName(called)
        return self.AddNode(node)

    def RemoveNode(self, node):
        self.nodes.remove(node)

    def Clear(self):
        self.close()

    def close(self):
        """What closing a scene does: Clear() without its singletons."""
        self.nodes = [node for node in self.nodes if node._singleton is not None]
        self.InvokeEvent(self.EndCloseEvent)

    def GetNodeByID(self, node_id):
        return next((node for node in self.nodes if node.GetID() == node_id), None)

    def GetFirstNodeByClass(self, class_name):
        return next((node for node in self.nodes if node.IsA(class_name)), None)

    def GetFirstNode(self, name, class_name):
        return next((node for node in self.nodes if node.GetName() == name and node.IsA(class_name)), None)


class Parameters:
    """vtkMRMLScriptedModuleNode.h"""

    def __init__(self):
        self._values = {}

    def GetParameter(self, name):
        return self._values.get(name, "")

    def SetParameter(self, name, value):
        self._values[name] = value


class VTKObservationMixin:
    """slicer/util.py"""

    def __init__(self):
        self._observations = {}

    def addObserver(self, node, event, method):
        assert (node, event, method) not in self._observations, "already has observer"
        self._observations[node, event, method] = node.AddObserver(event, method)

    def removeObserver(self, node, event, method):
        node.RemoveObserver(self._observations.pop((node, event, method)))

    def removeObservers(self):
        for (node, _, _), tag in self._observations.items():
            node.RemoveObserver(tag)
        self._observations.clear()


class ScriptedLoadableModule:
    def __init__(self, parent):
        self.parent = parent


class ScriptedLoadableModuleWidget:
    def __init__(self, parent=None):
        self.layout = Widget()

    def setup(self):
        pass


class ScriptedLoadableModuleLogic:
    parameters = None

    def __init__(self):
        pass

    def getParameterNode(self):
        return self.parameters


class ScriptedLoadableModuleTest(unittest.TestCase):
    def delayDisplay(self, text):
        self.said = text


class Widget:
    """What Qt's and Slicer's widgets are asked for. `connected` has the slots by signal."""

    def __init__(self, text=""):
        self.text = text
        self.value = 0
        self.wordWrap = False
        self.nodeTypes = []
        self.connected, self.children, self.checked, self.style = {}, [], [], ""

    def connect(self, signal, slot):
        self.connected[signal] = slot

    def addWidget(self, widget):
        self.children.append(widget)

    def addRow(self, label, widget):
        self.children.append(widget)

    def setRange(self, low, high):
        assert low < high

    def setValue(self, value):
        self.value = value

    def setTextFormat(self, format):
        self.format = format

    def setStyleSheet(self, style):
        self.style = style

    def setMRMLScene(self, scene):
        assert scene is not None

    def checkedNodes(self):
        return self.checked


class Timer:
    def __init__(self):
        self.interval, self.running, self.slot = None, False, None

    def setInterval(self, interval):
        self.interval = interval

    def connect(self, signal, slot):
        assert signal == "timeout()"
        self.slot = slot

    def start(self):
        self.running = True

    def stop(self):
        self.running = False


def install(with_openigtlink=True):
    """Puts new stand-ins into sys.modules and returns `slicer`. Modules that imported an earlier one are forgotten."""
    for name in [name for name in sys.modules if name == "Brainshift" or name.startswith("BrainshiftLib")]:
        del sys.modules[name]
    slicer = types.ModuleType("slicer")
    slicer.__path__ = []
    slicer.mrmlScene = Scene()
    slicer.vtkOrientedGridTransform = vtk.vtkGridTransform  # a subclass of it in Slicer
    slicer.vtkMRMLGridTransformNode = vtkMRMLGridTransformNode
    if with_openigtlink:
        slicer.vtkMRMLIGTLConnectorNode = vtkMRMLIGTLConnectorNode
    slicer.qMRMLCheckableNodeComboBox = Widget
    slicer.errors, slicer.layers = [], []
    util = types.ModuleType("slicer.util")
    util.VTKObservationMixin = VTKObservationMixin
    util.errorDisplay = slicer.errors.append
    util.setSliceViewerLayers = lambda **arguments: slicer.layers.append(arguments)
    util.getNodesByClass = lambda name: [node for node in slicer.mrmlScene.nodes if node.IsA(name)]
    slicer.util = util
    scripted = types.ModuleType("slicer.ScriptedLoadableModule")
    for cls in (ScriptedLoadableModule, ScriptedLoadableModuleWidget, ScriptedLoadableModuleLogic,
                ScriptedLoadableModuleTest):
        setattr(scripted, cls.__name__, cls)
    ScriptedLoadableModuleLogic.parameters = Parameters()
    qt, ctk = types.ModuleType("qt"), types.ModuleType("ctk")
    for name in ("QLabel", "QPushButton", "QLineEdit", "QSpinBox", "QCheckBox"):
        setattr(qt, name, type(name, (Widget,), {}))
    qt.Qt = types.SimpleNamespace(PlainText="plain")
    qt.QFormLayout = lambda parent: Widget()
    qt.QTimer = Timer
    ctk.ctkCollapsibleButton = Widget
    sys.modules.update({"slicer": slicer, "slicer.util": util, "slicer.ScriptedLoadableModule": scripted, "qt": qt,
                        "ctk": ctk})
    return slicer
