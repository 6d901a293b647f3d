//! What is said about texts that do not parse.

use crate::messages_of;

#[test]
fn placeholder() {
    assert!(messages_of("lamella 1").is_empty());
}
