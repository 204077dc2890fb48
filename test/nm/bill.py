"""The bill of materials lists each library that the binaries load, and no other: read from the binaries.

bill.py READELF BILL VERSION COMMAND LIBRARY...
"""
# SPDX-License-Identifier: Apache-2.0
import json
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note, output_of

readelf, bill, version, *binaries = sys.argv[1:]
# Names of libraries as loaders have them. OpenBLAS may be loaded through LAPACKE.
LOADED = {"OpenBLAS": "lib(openblas|blas|lapack)", "LAPACKE": "liblapacke", "libyaml": "libyaml", "expat": "libexpat", "jansson": "libjansson", "cairo": "libcairo",
          "HDF5": "libhdf5", "minizip": "libminizip", "assimp": "libassimp", "MPI": "libmpi"}
SYSTEM = r"lib(c|m|dl|pthread|rt|gcc_s|quadmath|kinetree.*)\.so.*|ld-linux.*"

content = json.loads(pathlib.Path(bill).read_text())
listed = {one["name"]: one for one in content["packages"]}
loads = {binary: set(re.findall(r"NEEDED.*\[(.+)\]", output_of(readelf, "-dW", binary))) for binary in binaries}
needed = set().union(*loads.values())
foreign = {name for name in needed if not re.fullmatch(SYSTEM, name)}
owner = {name: [one for one, pattern in LOADED.items() if re.match(pattern + r"\b|" + pattern + r"[-_]", name)] for name in foreign}
note(f"{len(foreign)} libraries of others, {len(listed) - 1} in the bill")
claim("each_library_that_is_loaded_is_in_the_bill", sorted(name for name, found in owner.items() if not set(found) & set(listed)))
claim("the_bill_has_no_other_library", sorted(set(listed) - {"Kinetree", "OpenBLAS"} - {one for found in owner.values() for one in found}))
modules = {one for one in ("hdf5", "assimp") if any(pathlib.Path(binary).name == f"libkinetree-{one}.so" for binary in binaries)}
claim("the_command_loads_large_libraries_when_it_needs_them", sorted(name for name in loads[binaries[0]] if name.startswith(tuple(f"lib{one}" for one in modules))))
claim("each_library_has_a_version_and_a_licence",
      [name for name, one in listed.items() if not re.match(r"\d+(\.\d+)*", one["versionInfo"]) or one["licenseDeclared"] == "NOASSERTION" and name != "MPI"])
claim("kinetree_has_its_version_and_its_licence", [] if (listed["Kinetree"]["versionInfo"], listed["Kinetree"]["licenseDeclared"]) == (version, "Apache-2.0") else [listed["Kinetree"]])
wanted = {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT"}
claim("the_document_has_the_fields_that_spdx_requires",
      [key for key, value in wanted.items() if content.get(key) != value] + [key for key in ("name", "documentNamespace", "creationInfo") if key not in content])
related = {(one["spdxElementId"], one["relationshipType"]) for one in content["relationships"]}
claim("the_document_describes_kinetree", [] if ("SPDXRef-DOCUMENT", "DESCRIBES") in related else sorted(related))
finish()
