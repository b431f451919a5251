//! Who may write into a run folder, and that nothing foreign is lost.

use std::fs;
use std::io::{self, Write};
use terramech_results::{Error, RunFolder};

#[test]
fn new_empty_and_earlier_folders_are_taken() {
    let dir = tempfile::tempdir().unwrap();
    RunFolder::create(dir.path()).unwrap();
    let deep = dir.path().join("a/b");
    RunFolder::create(&deep).unwrap().write("x.txt", b"1").unwrap();
    let again = RunFolder::create(&deep).unwrap();
    assert!(!deep.join("x.txt").exists(), "files of the earlier run go");
    again.write("x.txt", b"2").unwrap();
    assert_eq!(fs::read(deep.join("x.txt")).unwrap(), b"2");
}

#[test]
fn a_folder_with_other_content_is_refused_untouched() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("thesis.tex"), "years").unwrap();
    let error = RunFolder::create(dir.path()).unwrap_err();
    assert!(matches!(error, Error::FolderNotOurs { .. }) && error.is_users_mistake());
    assert!(error.to_string().contains("thesis.tex"), "{error}");
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    let file = dir.path().join("thesis.tex");
    assert!(matches!(RunFolder::create(file).unwrap_err(), Error::NotAFolder { .. }));
}

#[test]
fn foreign_files_stay() {
    let dir = tempfile::tempdir().unwrap();
    let run = RunFolder::create(dir.path()).unwrap();
    run.write("vtk/bed_000000.vtp", b"frame").unwrap();
    run.write("sub/only.txt", b"mine").unwrap();
    fs::write(dir.path().join("vtk/view.pvsm"), "state of a viewer").unwrap();
    fs::write(dir.path().join("results.csv"), "a note of the user's").unwrap();
    drop(run);
    let run = RunFolder::create(dir.path()).unwrap();
    assert!(dir.path().join("vtk/view.pvsm").exists());
    assert!(!dir.path().join("vtk/bed_000000.vtp").exists());
    assert!(!dir.path().join("sub").exists(), "emptied subfolders go");
    let error = run.write("results.csv", b"").unwrap_err();
    assert!(matches!(error, Error::ForeignFile { .. }), "{error}");
    assert_eq!(fs::read_to_string(dir.path().join("results.csv")).unwrap(), "a note of the user's");
}

#[test]
fn a_forged_list_deletes_nothing_outside() {
    let dir = tempfile::tempdir().unwrap();
    let (run, outside) = (dir.path().join("run"), dir.path().join("outside"));
    fs::create_dir(&outside).unwrap();
    fs::write(outside.join("kept"), "").unwrap();
    drop(RunFolder::create(&run).unwrap());
    let mut ledger = fs::OpenOptions::new().append(true).open(run.join(".terramech-run")).unwrap();
    writeln!(ledger, "../outside/kept\n{}\nlink/kept", outside.join("kept").display()).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(&outside, run.join("link")).unwrap();
    RunFolder::create(&run).unwrap();
    assert!(outside.join("kept").exists());
}

#[test]
fn names_that_leave_the_folder_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let run = RunFolder::create(dir.path()).unwrap();
    for name in ["", "../x", "/etc/x", "a/../../x", "a\nb", ".terramech-run"] {
        assert!(matches!(run.write(name, b"").unwrap_err(), Error::BadName { .. }), "{name:?}");
    }
}

#[test]
fn a_failed_write_leaves_the_earlier_version_whole() {
    let dir = tempfile::tempdir().unwrap();
    let run = RunFolder::create(dir.path()).unwrap();
    run.write("summary.json", b"whole").unwrap();
    let error = run.write_with("summary.json", |out| {
        out.write_all(b"half")?;
        Err(io::Error::other("disk full"))
    });
    assert!(error.unwrap_err().to_string().contains("disk full"));
    assert_eq!(fs::read(run.file("summary.json")).unwrap(), b"whole");
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 2, "no leftovers");
}

#[test]
fn a_folder_in_use_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let first = RunFolder::create(dir.path()).unwrap();
    first.write("a", b"1").unwrap();
    assert!(matches!(RunFolder::create(dir.path()).unwrap_err(), Error::FolderInUse { .. }));
    assert!(first.file("a").exists());
}
