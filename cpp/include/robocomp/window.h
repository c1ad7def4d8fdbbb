// A worker that is a window, over Qt 6. Events of the window run while the component waits for its own.
#pragma once

#include <QApplication>
#include <QDialog>
#include <QEvent>
#include <QEventLoop>
#include <QSocketNotifier>
#include <QString>
#include <QThread>
#include <QTimer>
#include <QWidget>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <memory>
#include <string>
#include <utility>

#include "robocomp/context.h"
#include "robocomp/errors.h"
#include "robocomp/program.h"
#include "robocomp/worker.h"

namespace rc {

namespace detail {

// Messages of Qt are lines of the component's log.
inline void log_of_qt(QtMsgType type, const QMessageLogContext&, const QString& text) {
  const std::string line = text.toStdString();
  switch (type) {
    case QtDebugMsg: return log_debug(line);
    case QtInfoMsg: return log_info(line);
    case QtWarningMsg: return log_warning(line);
    // Qt ends the process after a fatal one.
    default: return log_error(line);
  }
}

// The application of Qt, and its loop while the component waits.
class WindowApplication final : public QApplication {
 public:
  WindowApplication(int& count, char** arguments) : QApplication(count, arguments) {
    setQuitOnLastWindowClosed(false);
    timer_.setSingleShot(true);
    timer_.setTimerType(Qt::PreciseTimer);
    connect(&timer_, &QTimer::timeout, this, [this] { wake(); });
    end_of_wait = [] {
      const bool is_waiting = QThread::currentThread()->loopLevel() == 1;
      if (is_waiting) static_cast<WindowApplication*>(qApp)->wake();
    };
  }
  ~WindowApplication() override { end_of_wait = nullptr; }

  // Keeps an exception of an event: those of Qt's loop must not leave it.
  bool notify(QObject* receiver, QEvent* event) override {
    try {
      const bool is_done = QApplication::notify(receiver, event);
      // A loop inside a function of the worker has ended. Threads of the worker have events, too.
      const QThread* here = QThread::currentThread();
      if (here == thread() && is_late_ && here->loopLevel() == 1) wake();
      return is_done;
    } catch (...) {
      if (thrown_) {
        log_error("the window: " + current_exception_text());
      } else {
        thrown_ = std::current_exception();
        wake();
      }
      return false;
    }
  }

  // Stops the component once the window is closed.
  void watch(QWidget& window) {
    window.installEventFilter(this);
    if (auto* dialog = qobject_cast<QDialog*>(&window)) {
      connect(dialog, &QDialog::finished, this, [this] { stop(CLOSED); });
    }
  }

  // The window decides about its closing after this.
  bool eventFilter(QObject* watched, QEvent* event) override {
    if (event->type() == QEvent::Close) {
      QTimer::singleShot(0, watched, [this, window = static_cast<QWidget*>(watched)] {
        if (!window->isVisible()) stop(CLOSED);
      });
    }
    return QApplication::eventFilter(watched, event);
  }

  // Runs events until the descriptor is readable, the time is over, or the component stops. Throws
  // the exception of an event.
  void wait(int descriptor, std::chrono::nanoseconds limit) {
    if (!notifier_ || notifier_->socket() != descriptor) {
      notifier_ = std::make_unique<QSocketNotifier>(descriptor, QSocketNotifier::Read);
      connect(notifier_.get(), &QSocketNotifier::activated, this, [this] { wake(); });
    }
    notifier_->setEnabled(true);
    timer_.start(std::chrono::ceil<std::chrono::milliseconds>(limit));
    QEventLoop loop;
    loop_ = &loop;
    const int ended = loop.exec();
    loop_ = nullptr;
    timer_.stop();
    if (ended != WOKEN) stop("its window was quit");
    if (std::exception_ptr thrown = std::exchange(thrown_, nullptr)) std::rethrow_exception(thrown);
  }

 private:
  static constexpr int WOKEN = 1;
  static constexpr const char* CLOSED = "its window was closed";

  // Ends the wait. A loop inside a function of the worker, as of `QDialog::exec`, runs on: the component
  // waits for that function.
  void wake() {
    const int level = QThread::currentThread()->loopLevel();
    if (level == 0) return;
    is_late_ = level > 1;
    if (level == 1 && loop_ != nullptr) return loop_->exit(WOKEN);
    if (robocomp_get(RC_IS_STOPPING, 0).number != 0) return exit();
    if (notifier_ && notifier_->isEnabled()) {
      notifier_->setEnabled(false);
      if (!std::exchange(is_warned_, true)) {
        log_warning(
            "a function of the window waits in a loop of its own, such as exec(): compute() and handlers "
            "wait, too; open() shows a dialog without waiting");
      }
    }
    timer_.start(std::chrono::milliseconds(50));
  }

  void stop(const std::string& reason) {
    robocomp_set(RC_STOP, 0, 0, bytes(reason));
    wake();
  }

  std::unique_ptr<QSocketNotifier> notifier_;
  QTimer timer_;
  QEventLoop* loop_ = nullptr;
  std::exception_ptr thrown_;
  // Whether a loop inside a function of the worker keeps the component from its own events.
  bool is_late_ = false;
  bool is_warned_ = false;
};

// The application with the arguments that Qt keeps.
struct WindowOwner {
  std::string name = Context().name();
  int count = 1;
  char* arguments[2] = {name.data(), nullptr};
  WindowApplication application{count, arguments};
};

}  // namespace detail

// The base of a worker that is a `Widget` of Qt.
template <class Widget>
class Window : public Widget, public Worker {
 public:
  // Makes the application of Qt. Throws `Fatal` if there is no display.
  static std::shared_ptr<void> rc_prepare() {
    bool is_there = false;
    for (const char* variable : {"DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"}) {
      const char* value = std::getenv(variable);
      is_there = is_there || (value != nullptr && *value != '\0');
    }
    if (!is_there) {
      throw Fatal(
          "its window needs a display, but DISPLAY and WAYLAND_DISPLAY are not set; start the network in a "
          "session with a desktop, or set QT_QPA_PLATFORM=offscreen for a window that nobody sees");
    }
    qInstallMessageHandler(detail::log_of_qt);
    return std::make_shared<detail::WindowOwner>();
  }

 protected:
  void rc_show() final {
    if (this->windowTitle().isEmpty()) this->setWindowTitle(QString::fromStdString(Context().name()));
    application().watch(*this);
    this->show();
  }
  void rc_wait(int descriptor, std::chrono::nanoseconds limit) final {
    application().wait(descriptor, limit);
  }

 private:
  static detail::WindowApplication& application() {
    return *static_cast<detail::WindowApplication*>(qApp);
  }
};

}  // namespace rc
