//! The reply to a request, in a buffer or in memory of the library.

use rc_ddsc::{BEFORE_BODY, Loan, Writer};
use rc_middleware::rpc::ENVELOPE;
use rc_middleware::{Encoding, Profile, Reply};

/// Takes the reply to one request.
pub struct ReplyMemory<'a> {
    writer: &'a Writer,
    profile: Profile,
    buffer: Vec<u8>,
    loan: Option<Loan>,
    loan_is_reply: bool,
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
        }
    }

    /// The buffer, and the loan if it is the reply.
    pub fn finish(self) -> (Vec<u8>, Option<Loan>) {
        let loan = self.loan.filter(|_| self.loan_is_reply);
        (self.buffer, loan)
    }
}

/// How many bytes of a call in `profile` stand before the body that is sent.
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
}
