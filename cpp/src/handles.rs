//! Objects that a program in C++ holds by a number: lent samples, views of received ones, and started calls.
//! Objects of C++ may end on any thread.

use crate::border::Bytes;
use crate::status::Answer;
use rc_host::{Aligned, HostError, Image, Lent};
use rc_middleware::CallError;
use rc_middleware::typed::{Call, CallId};
use rc_values::{Struct, ValueError, check_image};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// One of them. Its drop ends it.
pub(crate) enum Held {
    /// A received sample, of which the program has a view.
    Image(#[expect(dead_code, reason = "it owns the memory")] Image),
    /// A sample that the program writes.
    Loan(Loan),
    /// A started call. Without it, the call is forgotten.
    Call(Call<Answer, CallError>),
}

/// A sample that the program writes and sends.
pub(crate) struct Loan {
    /// The topic, and the type of its samples.
    pub(crate) slot: usize,
    pub(crate) operation: usize,
    pub(crate) request: Arc<Struct>,
    pub(crate) memory: LoanMemory,
}

/// The memory of a loan.
pub(crate) enum LoanMemory {
    /// Of the middleware.
    Lent(Lent),
    /// No middleware lends it: the sample is copied when it is sent.
    Own(Aligned),
}

struct Handles {
    last: u64,
    /// In the order of their numbers. A program holds few, mostly for a short time.
    all: Vec<(u64, Held)>,
}

static HANDLES: Mutex<Handles> = Mutex::new(Handles {
    last: 0,
    all: Vec::new(),
});

impl Handles {
    fn get(&self, number: u64) -> Option<&Held> {
        let at = self.all.binary_search_by_key(&number, |(of, _)| *of).ok()?;
        Some(&self.all[at].1)
    }

    fn remove(&mut self, number: u64) -> Option<Held> {
        let at = self.all.binary_search_by_key(&number, |(of, _)| *of).ok()?;
        Some(self.all.remove(at).1)
    }
}

fn handles() -> MutexGuard<'static, Handles> {
    HANDLES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Keeps it. Returns its number, which is not 0.
pub(crate) fn hold(held: Held) -> u64 {
    let mut handles = handles();
    handles.last += 1;
    let number = handles.last;
    handles.all.push((number, held));
    number
}

/// Keeps the image of a received sample, for a program that reads it without checks. Returns its number
/// and its memory.
///
/// # Errors
/// It holds no value of its type.
pub(crate) fn hold_image(ty: &Struct, mut image: Image) -> Result<(u64, Bytes), ValueError> {
    let memory = match &mut image {
        Image::Copied(image) => image.bytes_mut(),
        Image::Kept(sample, _) => sample.memory(),
    };
    check_image(ty, memory)?;
    // The address stays when the owner moves.
    let memory = Bytes::of(memory);
    Ok((hold(Held::Image(image)), memory))
}

/// Ends it. An unknown number is one that has ended.
pub(crate) fn drop_held(number: u64) {
    let held = handles().remove(number);
    // Without the lock: the drop may give memory back to a middleware.
    drop(held);
}

/// Takes a loan, to send it.
///
/// # Errors
/// It was sent, or this is not the thread of its publisher.
pub(crate) fn take_loan(number: u64) -> Result<Option<Loan>, HostError> {
    let mut handles = handles();
    if let Some(Held::Loan(loan)) = handles.get(number)
        && let LoanMemory::Lent(lent) = &loan.memory
        && !lent.is_here()
    {
        return Err(HostError::WrongThread);
    }
    Ok(match handles.remove(number) {
        Some(Held::Loan(loan)) => Some(loan),
        _ => None,
    })
}

/// Passes a started call to `use_it`. `None` if there is none of this number.
pub(crate) fn with_call<T>(
    number: u64,
    use_it: impl FnOnce(&Call<Answer, CallError>) -> T,
) -> Option<T> {
    match handles().get(number) {
        Some(Held::Call(call)) => Some(use_it(call)),
        _ => None,
    }
}

/// The number of a started call.
pub(crate) fn of_call(id: CallId) -> Option<u64> {
    let handles = handles();
    let mut all = handles.all.iter();
    let found = all.find(|(_, held)| matches!(held, Held::Call(call) if call.id() == id));
    found.map(|(number, _)| *number)
}
