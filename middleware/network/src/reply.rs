//! The reply to a request, in a buffer or in memory of the library.

use rc_ddsc::{BEFORE_BODY, Loan, Writer};
use rc_middleware::rpc::ENVELOPE;
use rc_middleware::{DeferredReply, Encoding, Profile, Reply};
use std::time::Duration;

/// Takes the reply to one request.
pub struct ReplyMemory<'a> {
    writer: &'a Writer,
    profile: Profile,
    buffer: Vec<u8>,
    loan: Option<Loan>,
    loan_is_reply: bool,
    later: Option<&'a dyn Fn() -> Box<dyn DeferredReply>>,
    is_deferred: bool,
    age: Duration,
}

/// The form of a reply.
pub enum Written {
    /// It is in the buffer, which may be empty.
    Buffer(Vec<u8>),
    /// It is in memory of the library. The buffer may be used again.
    Loan(Loan, Vec<u8>),
    /// It will be sent later.
    Deferred(Vec<u8>),
}

impl<'a> ReplyMemory<'a> {
    /// For a reply that `writer` sends. `buffer` is reused.
    pub fn new(writer: &'a Writer, profile: Profile, mut buffer: Vec<u8>) -> Self {
        buffer.clear();
        Self {
            writer,
            profile,
            buffer,
            loan: None,
            loan_is_reply: false,
            later: None,
            is_deferred: false,
            age: Duration::ZERO,
        }
    }

    /// The age of its value.
    pub fn age(&self) -> Duration {
        self.age
    }

    /// With the state for sending the reply if it is deferred.
    #[must_use]
    pub fn or_later(mut self, later: &'a dyn Fn() -> Box<dyn DeferredReply>) -> Self {
        self.later = Some(later);
        self
    }

    /// The reply.
    pub fn finish(self) -> Written {
        match self.loan.filter(|_| self.loan_is_reply) {
            _ if self.is_deferred => Written::Deferred(self.buffer),
            Some(loan) => Written::Loan(loan, self.buffer),
            None => Written::Buffer(self.buffer),
        }
    }
}

/// How many bytes of a call in `profile` precede the body that is sent.
fn before_body(profile: Profile) -> usize {
    match profile {
        Profile::Rpc => 0,
        Profile::Bare => ENVELOPE,
    }
}

impl Reply for ReplyMemory<'_> {
    fn body(&mut self) -> &mut Vec<u8> {
        &mut self.buffer
    }

    fn set_age(&mut self, age: Duration) {
        self.age = age;
    }

    fn profile(&self) -> Profile {
        self.profile
    }

    /// A sample has an encapsulation and no image.
    fn can_loan(&self, encoding: Encoding) -> bool {
        encoding == Encoding::Cdr
    }

    fn loan(&mut self, length: usize, encoding: Encoding) -> Option<&mut [u8]> {
        if !self.can_loan(encoding) {
            return None;
        }
        let before = before_body(self.profile);
        let loan = self.writer.loan(length.checked_sub(before)?).ok()?;
        Some(&mut self.loan.insert(loan).memory()[BEFORE_BODY - before..])
    }

    fn send_loan(&mut self) {
        self.loan_is_reply = true;
    }

    fn defer(&mut self) -> Option<Box<dyn DeferredReply>> {
        let later = self.later.take()?;
        self.is_deferred = true;
        Some(later())
    }
}
