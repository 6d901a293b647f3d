//! Messages as text and as JSON. (under construction)
