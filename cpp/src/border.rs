//! The interface in C: the functions that the headers call, and the one that they hand over. All
//! `unsafe` of this crate is here.
#![allow(
    unsafe_code,
    reason = "pointers of another language; each block has its argument"
)]

use crate::bench::{self, Act};
use crate::call::{Call, Guest};
use crate::component::Component;
use crate::context::{self, Get, Set};
use crate::handles;
use crate::status::{Answer, DONE, INTERNAL};
use rc_host::Program;
use rc_runtime::tracing;
use std::cell::RefCell;
use std::ffi::{OsString, c_void};
use std::os::unix::ffi::OsStringExt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// The version of this interface, `RC_ABI_VERSION` of `abi.h`: raised with every change of it.
const VERSION: u32 = 6;

/// The exit code of a component that cannot start.
const NOT_STARTED: u8 = 3;

/// The exit code after a panic.
const PANICKED: u8 = 101;

/// `rc_bytes`: bytes of the caller, or of the callee until its next call.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Bytes {
    data: *const u8,
    size: usize,
}

impl Bytes {
    pub(crate) fn of(bytes: &[u8]) -> Self {
        Self {
            data: bytes.as_ptr(),
            size: bytes.len(),
        }
    }

    /// Memory that the program may write.
    pub(crate) fn writable(bytes: &mut [u8]) -> Self {
        Self {
            data: bytes.as_mut_ptr(),
            size: bytes.len(),
        }
    }

    /// The bytes themselves.
    ///
    /// # Safety
    /// They are readable and nobody writes them for `'a`, or their size is 0.
    unsafe fn borrow<'a>(self) -> &'a [u8] {
        if self.size == 0 {
            return &[];
        }
        // SAFETY: the caller says so.
        unsafe { std::slice::from_raw_parts(self.data, self.size) }
    }

    /// A copy.
    ///
    /// # Safety
    /// The bytes are readable, or their size is 0.
    unsafe fn to_vec(self) -> Vec<u8> {
        // SAFETY: the caller says so; nothing writes them during this function.
        unsafe { self.borrow() }.to_vec()
    }

    /// A copy of a text, whatever its encoding is.
    ///
    /// # Safety
    /// As of [`Bytes::to_vec`].
    unsafe fn to_text(self) -> String {
        // SAFETY: the caller says so; nothing writes them during this function.
        String::from_utf8_lossy(unsafe { self.borrow() }).into_owned()
    }
}

/// `rc_answer`.
#[repr(C)]
pub struct RawAnswer {
    status: i32,
    number: i64,
    bytes: Bytes,
}

/// `rc_call`: a call of a function of the worker.
#[repr(C)]
pub struct RawCall {
    function: i32,
    first: usize,
    second: usize,
    name: Bytes,
    member: usize,
    body: Bytes,
    held: u64,
    status: i32,
    number: i64,
}

/// The function of the headers that runs one of the worker's. It throws nothing.
type RawGuest = unsafe extern "C" fn(*mut c_void, *const RawCall) -> RawAnswer;

/// Functions in C++ with their object: a worker, or the fakes of a test.
fn guest(run: RawGuest, object: *mut c_void) -> Guest {
    Box::new(move |call: &Call<'_>| {
        let has_reply = call.has_reply;
        let call = RawCall {
            function: call.function as i32,
            first: call.numbers.0,
            second: call.numbers.1,
            name: Bytes::of(call.name.as_bytes()),
            member: call.member,
            body: call.image.unwrap_or(Bytes::of(call.body)),
            held: call.held,
            status: call.ended.0,
            number: call.ended.1,
        };
        // SAFETY: the program handed over the function with its object, which live until
        // `robocomp_run` returns or the bench closes, and this is its thread. Name and body live until the
        // function returns, which keeps no pointer, except of an image, which lives until the program drops
        // its number.
        let answer = unsafe { run(object, &raw const call) };
        let bytes = if answer.status == DONE && !has_reply {
            Vec::new()
        } else {
            // SAFETY: the object keeps the bytes of its answer until its next call.
            unsafe { answer.bytes.to_vec() }
        };
        Answer::new(answer.status, answer.number, bytes)
    })
}

thread_local! {
    /// The bytes of the last answer to this thread.
    static ANSWER: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
}

/// Answers a call of the headers. A panic is an error of the call.
fn answer(act: impl FnOnce() -> Result<Answer, Answer>) -> RawAnswer {
    let acted = catch_unwind(AssertUnwindSafe(act));
    let panicked = |_| Answer::new(INTERNAL, 0, "the runtime panicked; its log has the place");
    let answer = acted.unwrap_or_else(|panic| Err(panicked(panic)));
    let answer = answer.unwrap_or_else(|error| error);
    let bytes = if answer.bytes.is_empty() {
        Bytes::of(&[])
    } else {
        // A destructor of a thread-local object may ask after the end of this one.
        let bytes = ANSWER.try_with(|kept| {
            let mut kept = kept.borrow_mut();
            *kept = answer.bytes;
            Bytes::of(&kept)
        });
        bytes.unwrap_or(Bytes::of(&[]))
    };
    RawAnswer {
        status: answer.status,
        number: answer.number,
        bytes,
    }
}

/// `rc_program`: a component as its generated code hands it over.
#[repr(C)]
pub struct RawProgram {
    version: u32,
    /// The version of the headers' release, for people.
    release: Bytes,
    description: Bytes,
    folder: Bytes,
    call: RawGuest,
    object: *mut c_void,
}

/// Why a program of another version cannot run; `None` for one of this version.
///
/// # Safety
/// `program` begins as every `rc_program`.
unsafe fn other_version(program: *const RawProgram) -> Option<String> {
    // SAFETY: every version begins with its number and the text of its release.
    let (version, release) = unsafe { ((*program).version, (*program).release.to_text()) };
    let own = env!("CARGO_PKG_VERSION");
    (version != VERSION).then(|| {
        format!(
            "this program was built with the headers of robocomp {release}, whose interface is version \
             {version}; librobocomp_cpp.so is of robocomp {own}, whose interface is version {VERSION}; \
             build the program again: `rcdeploy up --build`"
        )
    })
}

/// Reads the description of a program.
///
/// # Safety
/// `program` is a whole `rc_program` of this version, whose texts are readable.
unsafe fn read_program(program: *const RawProgram) -> Result<Arc<Program>, String> {
    // SAFETY: the caller says so.
    let (description, folder) = unsafe {
        let program = &*program;
        (program.description.to_text(), program.folder.to_text())
    };
    match Program::read(&description) {
        Ok(program) => Ok(Arc::new(program.in_folder(folder))),
        Err(error) => Err(format!("{error}; generate the component again")),
    }
}

/// Runs a component until it ends. Returns the exit code.
///
/// # Safety
/// `program` is a whole `rc_program` of the version that it names first, and `arguments` are `count`
/// texts that end with a zero. All of it lives until this returns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn robocomp_run(
    program: *const RawProgram,
    count: usize,
    arguments: *const *const std::ffi::c_char,
) -> i32 {
    // SAFETY: every version begins so.
    if let Some(error) = unsafe { other_version(program) } {
        eprintln!("error: {error}");
        return NOT_STARTED.into();
    }
    // SAFETY: the version is that of this structure, which lives until this returns.
    let (call, object) = unsafe { ((*program).call, (*program).object) };
    // SAFETY: as above.
    let program = match unsafe { read_program(program) } {
        Ok(program) => program,
        Err(error) => {
            eprintln!("error: {error}");
            return NOT_STARTED.into();
        }
    };
    // SAFETY: `arguments` are `count` texts of C.
    let arguments = unsafe {
        let texts = (0..count).map(|at| std::ffi::CStr::from_ptr(*arguments.add(at)));
        texts
            .map(|text| OsString::from_vec(text.to_bytes().to_vec()))
            .collect::<Vec<_>>()
    };
    let run = || {
        let description = program.description;
        let own = std::env::current_exe().unwrap_or_default();
        rc_runtime::run_with(
            description,
            move |core, ports: &_, values: &_| {
                context::enter(&program);
                Component::start(program, guest(call, object), core, ports, values)
            },
            arguments,
            own,
        )
    };
    exit_code(run)
}

/// The exit code of a component. A panic outside of the functions of a worker has that of Rust's programs.
fn exit_code(run: impl FnOnce() -> u8) -> i32 {
    catch_unwind(AssertUnwindSafe(run))
        .unwrap_or(PANICKED)
        .into()
}

/// Does what has no answer. After a panic, it is not done.
fn quietly(act: impl FnOnce()) {
    let _ = catch_unwind(AssertUnwindSafe(act));
}

/// Calls a query, or sends a command. The reply is the answer's value.
///
/// # Safety
/// The bytes of `body` are readable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn robocomp_call(slot: usize, operation: usize, body: Bytes) -> RawAnswer {
    // SAFETY: the caller says so, and its program writes them in no function that runs meanwhile.
    let body = unsafe { body.borrow() };
    answer(|| context::call(slot, operation, body))
}

/// Starts a query. The number of the answer is that of the call.
///
/// # Safety
/// The bytes of `body` are readable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn robocomp_start(slot: usize, operation: usize, body: Bytes) -> RawAnswer {
    // SAFETY: the caller says so, and its program writes them in no function that runs meanwhile.
    let body = unsafe { body.borrow() };
    answer(|| context::start(slot, operation, body))
}

/// Takes the result of a started call, once.
#[unsafe(no_mangle)]
pub extern "C" fn robocomp_take(slot: usize, call: u64) -> RawAnswer {
    answer(|| context::take(slot, call))
}

/// Begins a sample in place. The answer has its number, and memory that the program may write until it
/// sends or drops the number.
#[unsafe(no_mangle)]
pub extern "C" fn robocomp_loan(slot: usize, operation: usize) -> RawAnswer {
    let mut memory = None;
    let mut begun = answer(|| {
        let (begun, bytes) = context::loan(slot, operation)?;
        memory = Some(bytes);
        Ok(begun)
    });
    if let Some(memory) = memory {
        begun.bytes = memory;
    }
    begun
}

/// Publishes a sample in place.
#[unsafe(no_mangle)]
pub extern "C" fn robocomp_send(loan: u64) -> RawAnswer {
    answer(|| context::send(loan))
}

/// Ends a view, a loan, or a started call, from any thread.
#[unsafe(no_mangle)]
pub extern "C" fn robocomp_drop(number: u64) {
    // A value that cannot be dropped stays.
    quietly(|| handles::drop_held(number));
}

/// Publishes a sample.
///
/// # Safety
/// The bytes of `body` are readable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn robocomp_publish(slot: usize, operation: usize, body: Bytes) -> RawAnswer {
    // SAFETY: the caller says so, and its program writes them in no function that runs meanwhile.
    let body = unsafe { body.borrow() };
    answer(|| context::publish(slot, operation, body))
}

/// The newest sample of a topic. The number of the answer has its age.
#[unsafe(no_mangle)]
pub extern "C" fn robocomp_newest(slot: usize, operation: usize) -> RawAnswer {
    answer(|| context::newest(slot, operation))
}

/// Sets the result that answers a query.
///
/// # Safety
/// The bytes of `body` are readable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn robocomp_set_latest(
    slot: usize,
    operation: usize,
    body: Bytes,
) -> RawAnswer {
    // SAFETY: the caller says so, and its program writes them in no function that runs meanwhile.
    let body = unsafe { body.borrow() };
    answer(|| context::set_latest(slot, operation, body))
}

/// Reads something of the component, an `enum rc_get_what`.
#[unsafe(no_mangle)]
pub extern "C" fn robocomp_get(what: u32, number: usize) -> RawAnswer {
    answer(|| match Get::ALL.get(what as usize) {
        Some(what) => context::get(*what, number),
        None => Err(unknown(what)),
    })
}

/// Changes something of the component, an `enum rc_set_what`.
///
/// # Safety
/// The bytes of `text` are readable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn robocomp_set(
    what: u32,
    number: usize,
    value: i64,
    text: Bytes,
) -> RawAnswer {
    // SAFETY: the caller says so.
    let text = unsafe { text.to_text() };
    answer(|| match Set::ALL.get(what as usize) {
        Some(what) => context::set(*what, number, value, &text),
        None => Err(unknown(what)),
    })
}

fn unknown(what: u32) -> Answer {
    Answer::new(INTERNAL, 0, format!("the interface has no number {what}"))
}

/// Logs a line, from any thread. Levels: 1 error, 2 warning, 3 information, 4 debug.
///
/// # Safety
/// The bytes of `text` are readable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn robocomp_log(level: u32, text: Bytes) {
    // SAFETY: the caller says so.
    let text = unsafe { text.to_text() };
    // A line that cannot be logged is lost.
    quietly(|| match level {
        0 | 1 => tracing::error!("{text}"),
        2 => tracing::warn!("{text}"),
        3 => tracing::info!("{text}"),
        _ => tracing::debug!("{text}"),
    });
}

/// Opens the bench of a test on this thread: the component with fake peers. `program.call` is the
/// function that answers for them.
///
/// # Safety
/// `program` is a whole `rc_program` of the version that it names first. Its function and object live
/// until the bench closes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn robocomp_test_open(program: *const RawProgram) -> RawAnswer {
    answer(|| {
        let failed = |error: String| Answer::new(INTERNAL, 0, error);
        // SAFETY: every version begins so.
        if let Some(error) = unsafe { other_version(program) } {
            return Err(failed(error));
        }
        // SAFETY: the version is that of this structure, which lives until this returns.
        let fakes = unsafe { guest((*program).call, (*program).object) };
        // SAFETY: as above.
        let program = unsafe { read_program(program) }.map_err(failed)?;
        bench::open(program, fakes)
    })
}

/// Makes the worker under test, with these values of its parameters.
///
/// # Safety
/// The bytes of `parameters` are readable; the function and its object live until the bench closes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn robocomp_test_start(
    call: RawGuest,
    object: *mut c_void,
    parameters: Bytes,
) -> RawAnswer {
    // SAFETY: the caller says so.
    let parameters = unsafe { parameters.to_vec() };
    answer(|| bench::start(guest(call, object), &parameters))
}

/// Does something with the bench, an `enum rc_test_what`.
///
/// # Safety
/// The bytes of `text` are readable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn robocomp_test(
    what: u32,
    slot: usize,
    value: i64,
    text: Bytes,
) -> RawAnswer {
    // SAFETY: the caller says so.
    let text = unsafe { text.to_text() };
    answer(|| match Act::ALL.get(what as usize) {
        Some(act) => bench::act(*act, slot, value, &text),
        None => Err(unknown(what)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::call::Function;
    use rc_runtime::WorkerError;

    #[test]
    fn a_panic_of_the_runtime_is_an_error_on_the_other_side() {
        let answer = answer(|| panic!("a fault of the runtime"));
        assert_eq!(answer.status, INTERNAL);
        // SAFETY: the bytes live until the next answer to this thread.
        let reason = unsafe { answer.bytes.to_text() };
        assert_eq!(reason, "the runtime panicked; its log has the place");
        assert_eq!(exit_code(|| panic!("a fault of the runtime")), 101);
        assert_eq!(exit_code(|| NOT_STARTED), 3);
        quietly(|| panic!("a fault of the runtime"));
        // The border works on.
        let answer = super::answer(|| Ok(Answer::number(7)));
        assert_eq!((answer.status, answer.number), (0, 7));
    }

    /// As the headers answer for a function of the worker that has thrown.
    unsafe extern "C" fn throws(_: *mut c_void, call: *const RawCall) -> RawAnswer {
        // SAFETY: `guest` hands over a call.
        let function = unsafe { (*call).function };
        assert_eq!(function, Function::Compute as i32);
        let what = b"std::runtime_error: no scan";
        RawAnswer {
            status: crate::status::FAILED,
            number: 0,
            bytes: Bytes::of(what),
        }
    }

    #[test]
    fn an_exception_of_the_worker_is_an_error_of_its_function() {
        let guest = guest(throws, std::ptr::null_mut());
        let outcome = guest(&Call::of(Function::Compute)).outcome();
        let Some(Err(WorkerError::Failed(reason))) = outcome else {
            panic!("{outcome:?}");
        };
        assert_eq!(reason, "std::runtime_error: no scan");
    }
}
