use boresight_app::window::services::Ended;

/// State of a session, on the result page.
#[derive(Clone, Copy, Debug)]
pub enum State<'a> {
    /// No session.
    Nothing,
    /// Views are being taken.
    Running,
    /// The session is being stored.
    Ending,
    /// The session is stored.
    Ended(&'a Ended),
}
