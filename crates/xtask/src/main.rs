//! Everything a newcomer or CI runs: `cargo xtask demo|test|pack|validate|bench`.
fn main() {}
