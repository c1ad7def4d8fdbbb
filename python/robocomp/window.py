"""The window of a worker with `gui Qt(…);`, over PySide6.

Its events run while the component waits for its own, on the thread of the worker.
"""

import functools
import logging
import math
import os
import sys
import threading
import types
import weakref
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from robocomp._context import Context
from robocomp._context import _Window as _EndOfWait
from robocomp._errors import Fatal, StartError

try:
    from PySide6.QtCore import (
        QAbstractEventDispatcher,
        QCoreApplication,
        QEvent,
        QEventLoop,
        QMessageLogContext,
        QMetaObject,
        QObject,
        QSocketNotifier,
        Qt,
        QThread,
        QTimer,
        QtMsgType,
        qInstallMessageHandler,
    )
    from PySide6.QtUiTools import QUiLoader
    from PySide6.QtWidgets import QApplication, QDialog, QMainWindow, QWidget
except ImportError as error:
    raise ImportError(
        f"the window of this component needs PySide6, which {sys.executable} cannot import "
        f"({' '.join(str(error).split())}); install it with: {sys.executable} -m pip install "
        "PySide6-Essentials, and on Debian and Ubuntu: apt install libegl1 libgl1 libxkbcommon0 "
        "libxkbcommon-x11-0 libdbus-1-3 libxcb-cursor0"
    ) from error

__all__ = ["QDialog", "QMainWindow", "QWidget", "Window"]

# The class of Qt is another base of the worker.
if TYPE_CHECKING:
    _Base = QWidget
else:
    _Base = object

# The log of the component has the messages of Qt.
_LEVELS = {
    QtMsgType.QtDebugMsg: logging.DEBUG,
    QtMsgType.QtInfoMsg: logging.INFO,
    QtMsgType.QtWarningMsg: logging.WARNING,
    QtMsgType.QtCriticalMsg: logging.ERROR,
    QtMsgType.QtFatalMsg: logging.CRITICAL,
}
_LOG = logging.getLogger("qt")


def _log_of_qt(kind: QtMsgType, _: QMessageLogContext, text: str | None) -> None:
    _LOG.log(_LEVELS.get(kind, logging.ERROR), "%s", text)


@functools.cache
def _application(name: str) -> QApplication:
    """The application of Qt, which a process has once."""
    if threading.current_thread() is not threading.main_thread():
        raise StartError("a window needs the main thread: start the component as a program")
    displays = ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")
    if not any(os.environ.get(variable) for variable in displays):
        raise Fatal(
            "its window needs a display, but DISPLAY and WAYLAND_DISPLAY are not set; start the "
            "network in a session with a desktop, or set QT_QPA_PLATFORM=offscreen for a window "
            "that nobody sees"
        )
    qInstallMessageHandler(_log_of_qt)
    application = QApplication([name])
    application.setQuitOnLastWindowClosed(False)
    return application


class _Form(QUiLoader):
    """Makes the widgets of a form in a window that is there."""

    def __init__(self, window: "Window") -> None:
        super().__init__()
        self._window = window
        self._classes = {class_.__name__: class_ for class_ in window.form_widgets}

    def createWidget(
        self, class_name: str, parent: QWidget | None = None, name: str = ""
    ) -> QWidget:
        if parent is None:
            return self._window
        class_ = self._classes.get(class_name)
        if class_ is None:
            return super().createWidget(class_name, parent, name)
        widget = class_(parent)
        widget.setObjectName(name)
        return widget


class _Wait(QObject):
    """The loop of Qt while the component waits."""

    _WOKEN = 1

    def __init__(self, context: Context) -> None:
        super().__init__()
        self._context = context
        self._notifier: QSocketNotifier | None = None
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self._wake)
        self._loop: QEventLoop | None = None
        self._thrown: BaseException | None = None
        self._is_warned = False
        # Whether a loop inside a function of the worker keeps the component from its own events.
        self._is_late = False
        _EndOfWait.end_of_wait = weakref.WeakMethod(self._look_again)

    def _look_again(self) -> None:
        """Ends the wait: an event of the window has changed what the component does next, or a loop
        inside a function of the worker has ended."""
        if QThread.currentThread().loopLevel() == 1:
            self._wake()

    def _set_late(self, is_late: bool) -> None:
        if is_late == self._is_late:
            return
        self._is_late = is_late
        dispatcher = QAbstractEventDispatcher.instance()
        if is_late:
            dispatcher.aboutToBlock.connect(self._look_again)
        else:
            dispatcher.aboutToBlock.disconnect(self._look_again)

    def watch(self, window: QWidget) -> None:
        """Stops the component once the window is closed."""
        self._window = window
        window.installEventFilter(self)
        if isinstance(window, QDialog):
            window.finished.connect(self._closed)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """The window decides about its closing after this."""
        if event.type() == QEvent.Type.Close:
            QTimer.singleShot(0, self._check)
        return super().eventFilter(watched, event)

    def _check(self) -> None:
        if not self._window.isVisible():
            self._closed()

    def _closed(self) -> None:
        self._stop("its window was closed")

    def run(self, descriptor: int, limit: timedelta) -> None:
        """Runs events until the descriptor is readable, the time is over, or the component stops.
        Raises the exception of an event."""
        notifier = self._notifier
        if notifier is not None and notifier.socket() != descriptor:
            # It would go on to end waits.
            notifier.setEnabled(False)
            notifier.deleteLater()
            notifier = None
        if notifier is None:
            notifier = QSocketNotifier(descriptor, QSocketNotifier.Type.Read, self)
            notifier.activated.connect(self._wake)
            self._notifier = notifier
        notifier.setEnabled(True)
        self._timer.start(math.ceil(limit / timedelta(milliseconds=1)))
        hook, sys.excepthook = sys.excepthook, self._keep
        self._loop = QEventLoop()
        try:
            ended = self._loop.exec()
        finally:
            self._loop = None
            sys.excepthook = hook
        self._timer.stop()
        if ended != self._WOKEN:
            self._stop("its window was quit")
        thrown, self._thrown = self._thrown, None
        if thrown is not None:
            raise thrown

    def _keep(
        self,
        kind: type[BaseException],
        error: BaseException,
        _: types.TracebackType | None,
    ) -> None:
        """Keeps the exception of an event, which Qt's loop does not pass on."""
        if self._thrown is None:
            self._thrown = error
            self._wake()
        else:
            _LOG.error("the window: %s: %s", kind.__name__, error)

    def _wake(self) -> None:
        """Ends the wait. A loop inside a function of the worker, as of `QDialog.exec`, runs on: the
        component waits for that function."""
        level = QThread.currentThread().loopLevel()
        if level == 0:
            return
        self._set_late(level > 1)
        if level == 1 and self._loop is not None:
            self._loop.exit(self._WOKEN)
            return
        if self._context.is_stopping:
            QCoreApplication.exit()
            return
        if self._notifier is not None and self._notifier.isEnabled():
            self._notifier.setEnabled(False)
            if not self._is_warned:
                self._is_warned = True
                _LOG.warning(
                    "a function of the window waits in a loop of its own, such as exec(): compute() "
                    "and handlers wait, too; open() shows a dialog without waiting"
                )
        self._timer.start(50)

    def _stop(self, reason: str) -> None:
        self._context.stop(reason)
        self._wake()


class Window(_Base):
    """The base of a worker that is a window, before the class of Qt.

    `ui` has the widgets and actions of `src/mainUI.ui` by their names.
    """

    form_widgets: ClassVar[tuple[type[QWidget], ...]] = ()
    """The classes of the worker's own that the form names."""

    # The generated class has the file.
    _form: ClassVar[Path]

    def __init__(self) -> None:
        _application(self._form.parents[1].name)
        super().__init__()
        loader = _Form(self)
        if loader.load(str(self._form)) is None:
            raise StartError(f"{self._form}: {loader.errorString()}")
        QMetaObject.connectSlotsByName(self)
        children: list[QObject] = list(self.findChildren(QObject))
        named = {child.objectName(): child for child in children if child.objectName()}
        self.ui: Any = types.SimpleNamespace(**named)

    def _robocomp_show(self, context: Context) -> None:
        self._robocomp_wait = _Wait(context)
        application = _application(self._form.parents[1].name)
        application.setApplicationName(context.name)
        self._robocomp_wait.watch(self)
        if not self.windowTitle():
            self.setWindowTitle(context.name)
        self.show()

    def _robocomp_run(self, descriptor: int, milliseconds: int) -> None:
        self._robocomp_wait.run(descriptor, timedelta(milliseconds=milliseconds))
