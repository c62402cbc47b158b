# SPDX-License-Identifier: GPL-3.0-or-later
"""build/blender makes a system once, and says why if it cannot: python3 tests/unit/test_systems.py. Stand-ins for debootstrap and what
needs root make a system of a few empty folders."""

import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[2] / "build/blender"
STANDINS = {
    "id": "echo 0",
    "unshare": 'while [[ $1 == -* ]]; do shift; done; exec "$@"',
    "mount": "exit 0",
    "apt-get": 'echo "Debian Debian http://mirror.test/debian/"',
    "apt-config": "exit 0",
    "debootstrap": 'echo "$@" >>"$CALLS"; root=${@: -2:1}; mkdir -p "$root"/{etc/apt/apt.conf.d,usr/sbin,proc,dev}',
    "chroot": '[[ "$*" == *"blender --version" ]] && echo "Blender 5.2.7 LTS"; exit 0',
}


class Systems(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name).resolve()
        (self.root / "build").mkdir()
        shutil.copy(SCRIPT, self.root / "build")
        self.tools, self.calls, self.out = self.root / "tools", self.root / "calls", self.root / "build/out"
        self.tools.mkdir()
        for name, text in STANDINS.items():
            self.stand_in(name, text)

    def stand_in(self, name, text):
        path = self.tools / name
        path.write_text(f"#!/bin/bash\n{text}\n")
        path.chmod(0o755)

    def run_it(self, version, path=None):
        environment = os.environ | {"PATH": path or f"{self.tools}:{os.environ['PATH']}", "CALLS": str(self.calls)}
        return subprocess.run([self.root / "build/blender", version], capture_output=True, text=True, check=False, env=environment)

    def made(self):
        return self.calls.read_text().splitlines() if self.calls.exists() else []

    def test_usage(self):
        self.assertEqual(self.run_it("4.0").returncode, 2)

    def test_it_is_made_once(self):
        for _ in range(2):
            done = self.run_it("5.2")
            self.assertEqual((done.returncode, done.stdout), (0, f"{self.out}/blender-5.2\n"), done.stderr)
            self.assertIn("5.2.7", done.stderr)
        self.assertEqual(len(self.made()), 1)
        self.assertTrue(self.made()[0].endswith(f"sid {self.out}/systems/sid.new http://mirror.test/debian/"), self.made())
        self.assertIn("Check-Valid-Until", (self.out / "systems/sid/etc/apt/apt.conf.d/90patina").read_text())
        self.assertTrue(os.access(self.out / "blender-5.2", os.X_OK) and os.access(self.out / "in-sid", os.X_OK))

    def test_programs_run_in_the_old_memory_layout(self):
        """Software Vulkan needs it: otherwise Blender runs out of memory mappings after some hundred redraws."""
        if subprocess.run(["setarch", "-L", "true"], capture_output=True, check=False).returncode:
            self.skipTest("this machine does not allow setarch -L")
        self.run_it("5.2")
        self.stand_in("unshare", "cat /proc/self/personality")
        done = subprocess.run([self.out / "blender-5.2"], capture_output=True, text=True, check=True,
                              env=os.environ | {"PATH": f"{self.tools}:{os.environ['PATH']}"})
        self.assertTrue(int(done.stdout, 16) & 0x0200000, done.stdout)

    def test_other_packages_make_it_anew(self):
        self.run_it("4.3")
        stamp = self.out / "systems/trixie.ready"
        stamp.write_text(stamp.read_text().replace("xvfb", "xvnc"))
        self.run_it("4.3")
        self.assertEqual(len(self.made()), 2)

    def failed(self, done, why):
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn(why, (self.out / "blender52.skip").read_text())
        self.assertEqual([path.name for path in (self.out / "systems").iterdir() if not path.name.startswith(".")], [])

    def test_a_mirror_that_fails(self):
        self.stand_in("debootstrap", 'mkdir -p "${@: -2:1}"; echo "E: no release" >&2; exit 1')
        self.failed(self.run_it("5.2"), "E: no release")
        self.stand_in("debootstrap", STANDINS["debootstrap"])
        self.assertEqual(self.run_it("5.2").returncode, 0)
        self.assertFalse((self.out / "blender52.skip").exists())

    def test_a_package_that_fails(self):
        self.stand_in("chroot", '[[ "$*" == *install* ]] && { echo "E: no package blender"; exit 100; }; exit 0')
        self.failed(self.run_it("5.2"), "E: no package blender")

    def test_no_root(self):
        self.stand_in("id", "echo 1000")
        self.stand_in("sudo", "exit 1")
        self.failed(self.run_it("5.2"), "needs root")

    def test_no_namespaces(self):
        self.stand_in("unshare", "exit 1")
        self.failed(self.run_it("5.2"), "mount namespaces")

    def test_no_room(self):
        self.stand_in("df", 'printf "Avail\\n100M\\n"')
        self.failed(self.run_it("5.2"), "the disk has 100 MB")


if __name__ == "__main__":
    unittest.main()
