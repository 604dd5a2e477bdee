//! What a tracker says of a marker.

/// What is known of a marker at a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum State {
    /// Seen.
    Valid = 1,
    /// Not fully trusted: not seen for a while, or seen again just now. It is on its way to where its neighbours put it,
    /// or back to where it is seen.
    Held = 2,
    /// No position at rest: it is never anywhere.
    Absent = 3,
    /// Not seen since a moment ago: it goes on as it went.
    Predicted = 4,
    /// Not seen for long: it is where its neighbours put it.
    Lost = 5,
}

/// Why what was seen of a marker is not believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Doubt {
    /// It is believed, or nothing was seen.
    None = 0,
    /// No body moves so fast: the marker counts as not seen.
    Speed = 1,
    /// It is another marker, under this one's name; they are told apart from now on.
    Swap = 2,
}
