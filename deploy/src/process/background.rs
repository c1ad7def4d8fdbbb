//! A supervisor in the background of its terminal.

/// Lets this process write from the background to a terminal that stops those who do (`stty
/// tostop`): stopped, a supervisor would watch nothing.
///
/// Its children inherit this: `cargo` may print, too, and components write to their logs.
#[expect(unsafe_code, reason = "no safe crate ignores a signal")]
pub fn write_from_background() {
    // SAFETY: the signal is ignored, so that no code runs as its handler. No other part of the
    // program has an action for it.
    unsafe {
        libc::signal(libc::SIGTTOU, libc::SIG_IGN);
    }
}
