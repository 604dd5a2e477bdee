//! Pages of lists.

use base64::{Engine as _, prelude::BASE64_URL_SAFE_NO_PAD};
use xxhash_rust::xxh3::xxh3_64_with_seed;

use crate::error::{ServiceError, invalid};

/// Reads a page's size, where `default` stands for 0 and no page has more than `most`.
pub(super) fn page_size(
    given: i32,
    (default, most): (usize, usize),
) -> Result<usize, ServiceError> {
    match usize::try_from(given) {
        Ok(0) => Ok(default),
        Ok(size) => Ok(size.min(most)),
        Err(_) => {
            let problem = format!("is {given}");
            let remedy = format!("give 1 to {most}");
            Err(invalid("VALUE_OUT_OF_RANGE", "page_size", problem, remedy))
        }
    }
}

/// A page token: the last name and a hash that a client does not make up by accident.
pub(super) fn page_token(last: &str) -> String {
    BASE64_URL_SAFE_NO_PAD.encode(format!("{:016x}{last}", token_hash(last)))
}

/// The last name on the page before; empty for the first page.
pub(super) fn read_token(token: &str) -> Result<String, ServiceError> {
    if token.is_empty() {
        return Ok(String::new());
    }
    let read = || {
        let text = String::from_utf8(BASE64_URL_SAFE_NO_PAD.decode(token).ok()?).ok()?;
        let (hash, last) = text.split_at_checked(16)?;
        (u64::from_str_radix(hash, 16).ok()? == token_hash(last)).then(|| last.to_owned())
    };
    read().ok_or_else(|| forged(token))
}

pub(super) fn forged(token: &str) -> ServiceError {
    let remedy = "use the next_page_token of the page before, or none";
    invalid(
        "PAGE_TOKEN_FORGED",
        "page_token",
        format!("`{token}` is no token of this API"),
        remedy,
    )
}

fn token_hash(last: &str) -> u64 {
    // "sinew" in ASCII: any server reads any server's tokens.
    xxh3_64_with_seed(last.as_bytes(), 0x73_69_6e_65_77)
}
