use boresight_app::host::Ended;

/// Where the session is.
#[derive(Clone, Copy, Debug)]
pub enum State<'a> {
    /// There is none.
    Nothing,
    /// Views are being taken.
    Running,
    /// It is being stored.
    Ending,
    /// It is stored.
    Ended(&'a Ended),
}
