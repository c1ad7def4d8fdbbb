//! The message and the place of a panic, for the final log line of the component.

use std::any::Any;
use std::cell::RefCell;
use std::panic::PanicHookInfo;

thread_local! {
    /// The last panic of this thread.
    static LAST: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Notes the panics of all threads from now on, and lets the hook before report them.
pub(super) fn note() {
    let before = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info: &PanicHookInfo<'_>| {
        let message = message(info.payload());
        let text = match info.location() {
            Some(place) => format!("{message} ({place})"),
            None => message.to_owned(),
        };
        // A destructor of the thread's end may panic, too.
        let _ = LAST.try_with(|last| last.replace(Some(text)));
        before(info);
    }));
}

/// The panic of this thread with this payload. A component may have set a hook of its own.
pub(super) fn taken(payload: &(dyn Any + Send)) -> String {
    let noted = LAST.with(RefCell::take);
    noted.unwrap_or_else(|| message(payload).to_owned())
}

fn message(payload: &(dyn Any + Send)) -> &str {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| payload.downcast_ref::<&str>().copied())
        .unwrap_or("a value that is not text")
}
