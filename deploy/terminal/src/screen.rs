//! Takes the terminal, draws on it, and always restores it.

use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::cursor::{Hide, Show};
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use signal_hook::SigId;
use signal_hook::consts::{SIGCONT, SIGWINCH};
use std::fs::File;
use std::io::{self, BufWriter, IsTerminal, Read};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Once};

/// Whether the view has the terminal.
static TAKEN: AtomicBool = AtomicBool::new(false);
static HOOK: Once = Once::new();

/// Whether standard input and output are a terminal that can show a full-screen view: it moves its
/// cursor, and this process is in its foreground.
pub fn usable() -> bool {
    let dumb = std::env::var_os("TERM").is_none_or(|term| term.is_empty() || term == "dumb");
    io::stdin().is_terminal() && io::stdout().is_terminal() && !dumb && in_foreground()
}

/// The system stops a background process that sets up a terminal.
fn in_foreground() -> bool {
    let foreground = rustix::termios::tcgetpgrp(io::stdin());
    foreground.is_ok_and(|group| group == rustix::process::getpgrp())
}

/// Whether colours are welcome (<https://no-color.org>).
pub(crate) fn colours() -> bool {
    std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// The terminal, while it shows the view.
pub(crate) struct Screen {
    pub(crate) terminal: Terminal<CrosstermBackend<BufWriter<File>>>,
    changes: Changes,
}

impl Screen {
    pub(crate) fn take() -> io::Result<Self> {
        HOOK.call_once(|| {
            let previous = std::panic::take_hook();
            std::panic::set_hook(Box::new(move |panic| {
                // The message of a panic must be readable.
                restore();
                previous(panic);
            }));
        });
        let changes = Changes::new()?;
        let out = File::from(io::stdout().as_fd().try_clone_to_owned()?);
        let out = BufWriter::with_capacity(64 * 1024, out);
        let terminal = Terminal::new(CrosstermBackend::new(out))?;
        let mut screen = Self { terminal, changes };
        screen.set_up()?;
        Ok(screen)
    }

    fn set_up(&mut self) -> io::Result<()> {
        TAKEN.store(true, Ordering::Relaxed);
        let done = enable_raw_mode().and_then(|()| {
            let out = self.terminal.backend_mut();
            execute!(out, EnterAlternateScreen, Hide)
        });
        done.and_then(|()| self.blank()).inspect_err(|_| restore())
    }

    /// Clears the screen, so that it is redrawn. `Terminal::clear` would ask the terminal for its
    /// cursor, and block.
    pub(crate) fn blank(&mut self) -> io::Result<()> {
        let size = self.terminal.size()?;
        self.terminal.resize(size.into())
    }

    /// Becomes readable when the terminal changes its size, or when this process continues after a
    /// stop.
    pub(crate) fn changes(&self) -> BorrowedFd<'_> {
        self.changes.pipe.as_fd()
    }

    /// Handles a change of the terminal. The size is read at the next drawing; after a stop, the
    /// terminal is set up again, unless another process has it.
    pub(crate) fn renew(&mut self) -> io::Result<()> {
        let mut buffer = [0; 64];
        while (&self.changes.pipe)
            .read(&mut buffer)
            .is_ok_and(|count| count == buffer.len())
        {}
        if self.changes.continued.swap(false, Ordering::Relaxed) && in_foreground() {
            // The shell has changed its mode.
            disable_raw_mode()?;
            self.set_up()?;
        }
        Ok(())
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        restore();
    }
}

/// Whether the view has the terminal. A panic of any thread restores it.
pub(crate) fn is_taken() -> bool {
    TAKEN.load(Ordering::Relaxed)
}

/// Restores the terminal. Any thread may call it; it happens once.
pub(crate) fn restore() {
    if TAKEN.swap(false, Ordering::Relaxed) {
        // A closed terminal needs nothing.
        let _ = execute!(io::stdout(), LeaveAlternateScreen, Show);
        let _ = disable_raw_mode();
    }
}

/// Restores only the mode, for a terminal that blocks output.
pub(crate) fn restore_mode() {
    if TAKEN.swap(false, Ordering::Relaxed) {
        let _ = disable_raw_mode();
    }
}

/// Signals that a terminal sends when it changes.
struct Changes {
    pipe: UnixStream,
    /// This process continues after a stop.
    continued: Arc<AtomicBool>,
    ids: Vec<SigId>,
}

impl Changes {
    fn new() -> io::Result<Self> {
        let (pipe, write) = UnixStream::pair()?;
        pipe.set_nonblocking(true)?;
        let continued = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&continued);
        let mut ids = vec![signal_hook::flag::register(SIGCONT, flag)?];
        for signal in [SIGWINCH, SIGCONT] {
            let write = write.try_clone()?;
            ids.push(signal_hook::low_level::pipe::register(signal, write)?);
        }
        Ok(Self {
            pipe,
            continued,
            ids,
        })
    }
}

impl Drop for Changes {
    fn drop(&mut self) {
        for id in self.ids.drain(..) {
            signal_hook::low_level::unregister(id);
        }
    }
}
