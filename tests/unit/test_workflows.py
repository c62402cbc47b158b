# SPDX-License-Identifier: GPL-3.0-or-later
"""build/check_workflows finds faults of workflows, and build/ci, which they call, refuses what is no release.

    build/out/lint/bin/python tests/unit/test_workflows.py"""

import copy
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from scripts import ROOT, run, script

check = script("check_workflows")
GOOD = {"permissions": {}, "jobs": {
    "pack": {"timeout-minutes": 1, "steps": [{"run": "build/ci packages"}, {"uses": "actions/upload-artifact@1", "with": {"name": "packages"}}]},
    "images": {"needs": "pack", "timeout-minutes": 1, "env": {"PLATFORM": "${{ matrix.platform }}"},
               "strategy": {"matrix": {"include": [{"platform": "linux-x64"}]}},
               "steps": [{"uses": "actions/download-artifact@1", "with": {"name": "packages"}}, {"run": 'build/ci try "$PLATFORM"'}]}}}
CALLED = {"./.github/workflows/packages.yml": GOOD["jobs"]}
GH = '#!/bin/sh\nprintf "%s\\n" "$@" >"$(dirname "$0")/called"\n'
NOTICES = '#!/bin/sh\n[ "$1" = --check ] && [ $# = 13 ]\n'


class Steps(unittest.TestCase):
    def faults(self, **changes: object) -> list[str]:
        """Of GOOD with other values of the job images."""
        workflow = copy.deepcopy(GOOD)
        workflow["jobs"]["images"].update({name.replace("_", "-"): value for name, value in changes.items()})
        return list(check.faults_of(workflow, CALLED))

    def only(self, part: str, **changes: object) -> None:
        found = self.faults(**changes)
        self.assertEqual(len(found), 1, found)
        self.assertIn(part, found[0])

    def test_a_good_workflow(self) -> None:
        self.assertEqual(self.faults(), [])

    def test_steps_call_scripts(self) -> None:
        for line in ("apt-get update", "build/ci quick && ls", "build/ci quick; ls", "build/ci $(id)", "build/ci quick\nls", "build/ci ${{ github.ref }}",
                     "cd build", "build/ci $PLATFORM"):
            self.only("let it run one script", steps=[{"run": line}])
        self.only("does not exist", steps=[{"run": "build/stray"}])
        self.only("does not exist or is not executable", steps=[{"run": "build/sanitized"}])
        self.only("does not know 'stray'", steps=[{"run": "build/ci stray"}])
        self.only("does not know ''", steps=[{"run": "build/ci"}])
        self.only("$OTHER is not set", steps=[{"run": 'build/ci try "$OTHER"'}])
        self.assertEqual(self.faults(steps=[{"run": 'build/ci try "$OTHER"', "env": {"OTHER": "1"}}]), [])

    def test_jobs(self) -> None:
        self.only("needs stray", needs=["pack", "stray"])
        self.only("reads matrix.stray", env={"PLATFORM": "${{ matrix.stray }}"})
        self.only("downloads logs", steps=[{"uses": "actions/download-artifact@1", "with": {"name": "logs"}}])
        self.only("downloads packages", needs=[])
        workflow = copy.deepcopy(GOOD)
        del workflow["permissions"], workflow["jobs"]["pack"]["timeout-minutes"]
        self.assertEqual(list(check.faults_of(workflow, CALLED)), ["it has no permissions; write 'contents: read'", "job pack has no timeout-minutes"])

    def test_hooks(self) -> None:
        def hooks(entry: str) -> list[str]:
            return list(check.faults_of_hooks({"repos": [{"hooks": [{"id": "a", "entry": entry}]}]}))
        self.assertEqual(hooks("build/format --check"), [])
        for entry in ("build/stray", "ls", "build/effects.py", "tests/names.py"):
            self.assertEqual(len(hooks(entry)), 1, entry)

    def test_called_workflows(self) -> None:
        call = {"permissions": {}, "jobs": {"packages": {"uses": "./.github/workflows/packages.yml"},
                "publish": {"needs": "packages", "timeout-minutes": 1, "steps": [{"uses": "actions/download-artifact@1", "with": {"name": "packages"}}]}}}
        self.assertEqual(list(check.faults_of(call, CALLED)), [])
        call["jobs"]["packages"]["uses"] = "./.github/workflows/stray.yml"
        self.assertIn("which does not exist", next(iter(check.faults_of(call, CALLED))))


class Tree(unittest.TestCase):
    @unittest.skipUnless(check.YAML, "workflows: build/setup installs what reads YAML")
    def test_own_faults(self) -> None:
        self.assertEqual(check.own_faults(), [])

    @unittest.skipUnless((check.LINT / "zizmor").exists(), "workflows: build/setup installs zizmor and check-jsonschema")
    def test_the_programs_find_faults(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "bad.yml"
            text = (check.FOLDER / "tests.yml").read_text(encoding="utf-8")
            path.write_text(text.replace("timeout-minutes: 60", "timeout-minutes: soon"), encoding="utf-8")
            self.assertIn("timeout-minutes", str(check.of_program("check-jsonschema", "--builtin-schema", "vendor.github-workflows", path)))
            path.write_text(re.sub(r"@\w{40}", "@v6", text), encoding="utf-8")
            self.assertIn("unpinned", str(check.of_program("zizmor", "--offline", "--quiet", "--no-progress", "--min-severity", "medium", path)))

    def test_every_platform_is_packed_and_drawn(self) -> None:
        platforms = set(script("package").PLATFORMS)
        drawn = set(re.findall(r"platform: ([\w-]+),", (check.FOLDER / "packages.yml").read_text(encoding="utf-8")))
        named = re.search(r"for platform in (.*); do", (ROOT / "build/ci").read_text(encoding="utf-8")).group(1).split()
        self.assertEqual(drawn, platforms)
        self.assertEqual(set(named), platforms)


class Release(unittest.TestCase):
    def setUp(self) -> None:
        """A tree with what build/ci reads, other programs in place of build/notices and gh, and all packages."""
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = Path(self.folder.name)
        for name in ("build/ci", "native/include/patina/patina.h"):
            (self.root / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, self.root / name)
        for name, text in (("build/notices", NOTICES), ("bin/gh", GH)):
            (self.root / name).parent.mkdir(exist_ok=True)
            (self.root / name).write_text(text)
            (self.root / name).chmod(0o755)
        self.version = script("package").version()
        self.change_log(f"# Changes\n\n## {self.version}, 2027-01-01\n\n- New.\n\n## 0.0.1, 2026-01-01\n\n- Old.\n")
        packages = self.root / "build/out/packages/all"
        packages.mkdir(parents=True)
        for platform in script("package").PLATFORMS:
            for end in ("", "-legacy"):
                (packages / f"patina-{self.version}-{platform}{end}.zip").touch()

    def change_log(self, text: str) -> None:
        (self.root / ".github").mkdir(exist_ok=True)
        (self.root / ".github/CHANGELOG.md").write_text(text)

    def release(self, tag: str = "") -> str:
        """What build/ci prints when it fails; empty if it released."""
        done = subprocess.run([self.root / "build/ci", "release", tag or f"v{self.version}"], capture_output=True, text=True, check=False,
                              env=os.environ | {"PATH": f"{self.root / 'bin'}:{os.environ['PATH']}"})
        self.assertEqual(done.returncode == 0, (self.root / "bin/called").exists(), done.stderr)
        return done.stderr if done.returncode else ""

    def test_a_release(self) -> None:
        self.assertEqual(self.release(), "")
        called = (self.root / "bin/called").read_text()
        self.assertTrue(called.startswith(f"release\ncreate\nv{self.version}\n--verify-tag\n"), called)
        self.assertIn("- New.", called)
        self.assertNotIn("- Old.", called)
        self.assertEqual(called.count(".zip\n"), 12)

    def test_refusals(self) -> None:
        self.assertIn("the tag is v9.9.9", self.release("v9.9.9"))
        zip = next((self.root / "build/out/packages/all").glob("*windows-arm64-legacy.zip"))
        zip.unlink()
        self.assertIn(f"{zip.name} is missing", self.release())
        zip.touch()
        self.change_log(f"## {self.version}, not released\n\n- New.\n")
        self.assertIn("write the date", self.release())
        self.change_log("## 0.0.1, 2026-01-01\n\n- Old.\n")
        self.assertIn("has no section", self.release())
        (self.root / "build/notices").write_text("#!/bin/sh\nexit 1\n")
        self.change_log(f"## {self.version}, 2027-01-01\n\n- New.\n")
        self.release()
        self.assertFalse((self.root / "bin/called").exists())

    def test_usage(self) -> None:
        for words in ([], ["stray"], ["try"], ["release"]):
            done = subprocess.run([ROOT / "build/ci", *words], capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 1)
            self.assertIn("usage", done.stderr)


if __name__ == "__main__":
    sys.exit(run())
