//! Counts of a replica.

/// The counts of a replica.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Changes of this replica.
    pub made: u64,
    /// Changes of others that arrived as they were made.
    pub received: u64,
    /// Changes that arrived after a gap: something before them was lost, or is late.
    pub gaps: u64,
    /// Values of streams that were sent.
    pub samples_sent: u64,
    /// Values of streams that were the newest.
    pub samples_received: u64,
    /// Questions for what this replica lacked.
    pub asked: u64,
    /// Questions of others that this replica answered.
    pub answered: u64,
    /// Messages that were refused.
    pub refused: u64,
    /// Messages that were not sent because too many waited.
    pub dropped: u64,
    /// Why the last refused message was.
    pub last_refusal: String,
}
