//! What a tracker can be told.

/// For how long, and how far, a marker is believed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How long a marker that is not seen goes on as it went, s.
    pub predict_seconds: f64,
    /// How long until it is where its neighbours put it, s, at least `predict`.
    pub release_seconds: f64,
    /// How long its way back takes, s.
    pub take_back_seconds: f64,
    /// The greatest change of speed from one step to the next that is believed, m/s; infinite where all is believed, and
    /// markers keep the names they come under.
    pub max_speed_change: f64,
    /// How long a marker must be seen in an unbelievable place to be believed, s.
    pub believe_seconds: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            predict_seconds: 0.1,
            release_seconds: 0.5,
            take_back_seconds: 0.1,
            max_speed_change: 12.0,
            believe_seconds: 1.0,
        }
    }
}

/// A setting that is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettingsError {
    /// Which field of [`Settings`].
    pub field: &'static str,
    /// Its value.
    pub value: f64,
    /// The least that it may be.
    pub least: f64,
}

impl Settings {
    /// Whether all of it can be.
    ///
    /// # Errors
    /// The first field that is below its least value or not finite.
    pub fn check(&self) -> Result<(), SettingsError> {
        let fields = [
            ("predict_seconds", self.predict_seconds, 0.0),
            (
                "release_seconds",
                self.release_seconds,
                self.predict_seconds,
            ),
            ("take_back_seconds", self.take_back_seconds, 0.0),
            ("max_speed_change", self.max_speed_change, f64::MIN_POSITIVE),
            ("believe_seconds", self.believe_seconds, 0.0),
        ];
        let wrong = |&(field, value, least): &(_, f64, f64)| {
            let endless = field == "max_speed_change" && value == f64::INFINITY;
            !(value.is_finite() && value >= least || endless)
        };
        match fields.into_iter().find(wrong) {
            None => Ok(()),
            Some((field, value, least)) => Err(SettingsError {
                field,
                value,
                least,
            }),
        }
    }
}
