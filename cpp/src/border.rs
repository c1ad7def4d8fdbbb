//! The interface in C: the functions that the headers call, and the one that they hand over. All
//! `unsafe` of this crate is here.
#![allow(
    unsafe_code,
    reason = "pointers of another language; each block has its argument"
)]

use crate::component::{Component, Function};
use crate::context::{self, Get, Set};
use crate::status::{Answer, INTERNAL};
use rc_host::Program;
use rc_runtime::tracing;
use std::cell::RefCell;
use std::ffi::{OsString, c_void};
use std::os::unix::ffi::OsStringExt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// The version of this interface, `RC_ABI_VERSION` of `abi.h`: raised with every change of it.
const VERSION: u32 = 2;

/// The exit code of a component that cannot start.
const NOT_STARTED: u8 = 3;

/// `rc_bytes`: bytes of the caller, or of the callee until its next call.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Bytes {
    data: *const u8,
    size: usize,
}

impl Bytes {
    fn of(bytes: &[u8]) -> Self {
        Self {
            data: bytes.as_ptr(),
            size: bytes.len(),
        }
    }

    /// A copy.
    ///
    /// # Safety
    /// The bytes are readable, or their size is 0.
    unsafe fn to_vec(self) -> Vec<u8> {
        if self.size == 0 {
            return Vec::new();
        }
        // SAFETY: the caller says so; nothing writes them during this function.
        unsafe { std::slice::from_raw_parts(self.data, self.size) }.to_vec()
    }

    /// A copy of a text, whatever its encoding is.
    ///
    /// # Safety
    /// As of [`Bytes::to_vec`].
    unsafe fn to_text(self) -> String {
        // SAFETY: the caller says so.
        String::from_utf8_lossy(&unsafe { self.to_vec() }).into_owned()
    }
}

/// `rc_answer`.
#[repr(C)]
pub struct RawAnswer {
    status: i32,
    number: i64,
    bytes: Bytes,
}

/// The function of the headers that runs one of the worker's. It throws nothing.
type RawCall = unsafe extern "C" fn(*mut c_void, i32, usize, usize, Bytes, Bytes) -> RawAnswer;

/// A worker in C++.
struct Guest {
    call: RawCall,
    object: *mut c_void,
}

impl Guest {
    /// Runs a function of the worker.
    fn call(&self, function: Function, numbers: (usize, usize), name: &str, body: &[u8]) -> Answer {
        let (name, body) = (Bytes::of(name.as_bytes()), Bytes::of(body));
        // SAFETY: `robocomp_run` got the function with its object, which live until it returns, and this
        // is its thread. Both texts live until the function returns, which keeps no pointer.
        let answer = unsafe {
            (self.call)(
                self.object,
                function as i32,
                numbers.0,
                numbers.1,
                name,
                body,
            )
        };
        // SAFETY: the object keeps the bytes of its answer until its next call.
        let bytes = unsafe { answer.bytes.to_vec() };
        Answer::new(answer.status, answer.number, bytes)
    }
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
    // A destructor of a thread-local object may ask after the end of this one.
    let bytes = ANSWER.try_with(|kept| {
        let mut kept = kept.borrow_mut();
        *kept = answer.bytes;
        Bytes::of(&kept)
    });
    RawAnswer {
        status: answer.status,
        number: answer.number,
        bytes: bytes.unwrap_or(Bytes::of(&[])),
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
    call: RawCall,
    object: *mut c_void,
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
    // SAFETY: every version begins with its number and the text of its release.
    let (version, release) = unsafe { ((*program).version, (*program).release.to_text()) };
    let own = env!("CARGO_PKG_VERSION");
    if version != VERSION {
        eprintln!(
            "error: this program was built with the headers of robocomp {release}, whose interface is version \
             {version}; librobocomp_cpp.so is of robocomp {own}, whose interface is version {VERSION}; \
             build the program again: `rcdeploy up --build`"
        );
        return NOT_STARTED.into();
    }
    // SAFETY: the version is that of this structure, and its texts live until this returns.
    let (description, folder, call, object) = unsafe {
        let program = &*program;
        let (description, folder) = (program.description.to_text(), program.folder.to_text());
        (description, folder, program.call, program.object)
    };
    // SAFETY: `arguments` are `count` texts of C.
    let arguments = unsafe {
        let texts = (0..count).map(|at| std::ffi::CStr::from_ptr(*arguments.add(at)));
        texts
            .map(|text| OsString::from_vec(text.to_bytes().to_vec()))
            .collect::<Vec<_>>()
    };
    let run = || {
        let program = match Program::read(&description) {
            Ok(program) => Arc::new(program.in_folder(folder)),
            Err(error) => {
                eprintln!("error: {error}; generate the component again");
                return NOT_STARTED;
            }
        };
        let description = program.description;
        let own = std::env::current_exe().unwrap_or_default();
        rc_runtime::run_with(
            description,
            move |core, ports: &_, values: &_| {
                context::enter(&program);
                let guest = Guest { call, object };
                let guest = move |function, numbers, name: &_, body: &_| {
                    guest.call(function, numbers, name, body)
                };
                Component::start(program, Box::new(guest), core, ports, values)
            },
            arguments,
            own,
        )
    };
    catch_unwind(AssertUnwindSafe(run)).unwrap_or(101).into()
}

/// Calls a query, or sends a command. The reply is the answer's value.
///
/// # Safety
/// The bytes of `body` are readable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn robocomp_call(slot: usize, operation: usize, body: Bytes) -> RawAnswer {
    // SAFETY: the caller says so.
    let body = unsafe { body.to_vec() };
    answer(|| context::call(slot, operation, &body))
}

/// Publishes a sample.
///
/// # Safety
/// The bytes of `body` are readable.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn robocomp_publish(slot: usize, operation: usize, body: Bytes) -> RawAnswer {
    // SAFETY: the caller says so.
    let body = unsafe { body.to_vec() };
    answer(|| context::publish(slot, operation, &body))
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
    // SAFETY: the caller says so.
    let body = unsafe { body.to_vec() };
    answer(|| context::set_latest(slot, operation, &body))
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
    let _ = catch_unwind(|| match level {
        0 | 1 => tracing::error!("{text}"),
        2 => tracing::warn!("{text}"),
        3 => tracing::info!("{text}"),
        _ => tracing::debug!("{text}"),
    });
}
