"""Validates system descriptions, parameter files and model descriptions against the official schemas and ours.

Usage: python check.py FILE...   (needs the packages fmpy, for its schemas, and lxml)
Our annotations are found inside a description and checked one by one: SSP's schema takes any element there.
"""

import importlib.util
import pathlib
import sys

from lxml import etree

HERE = pathlib.Path(__file__).parent
FMPY = pathlib.Path(importlib.util.find_spec("fmpy").origin).parent
SCHEMAS = {
    "SystemStructureDescription": FMPY / "ssp/schema/SystemStructureDescription.xsd",
    "ParameterSet": FMPY / "ssp/schema/SystemStructureParameterValues.xsd",
    "ParameterMapping": FMPY / "ssp/schema/SystemStructureParameterMapping.xsd",
    "fmiModelDescription": FMPY / "schema/fmi2/fmi2ModelDescription.xsd",
}
OURS = "http://terramech.org/SSP1/Annotations"


def faults(path):
    root = etree.parse(str(path)).getroot()
    schema = etree.XMLSchema(etree.parse(str(SCHEMAS[etree.QName(root).localname])))
    schema.validate(root)
    found = [f"{path}:{e.line}: {e.message}" for e in schema.error_log]
    ours = etree.XMLSchema(etree.parse(str(HERE / "org.terramech.xsd")))
    for element in root.iter(f"{{{OURS}}}Component", f"{{{OURS}}}System"):
        ours.validate(etree.fromstring(etree.tostring(element)))
        found += [f"{path}:{element.sourceline}: {e.message}" for e in ours.error_log]
    # Parameter sets and mappings inside a description are checked lax by its schema: check them here.
    for name in ("ParameterSet", "ParameterMapping"):
        inner = etree.XMLSchema(etree.parse(str(SCHEMAS[name])))
        for element in root.iter("{*}" + name):
            if element is not root and element.getparent() is not None and element.get("version"):
                inner.validate(etree.fromstring(etree.tostring(element)))
                found += [f"{path}:{element.sourceline}: {e.message}" for e in inner.error_log]
    return found


if __name__ == "__main__":
    found = [fault for path in sys.argv[1:] for fault in faults(path)]
    print("\n".join(found) or f"{len(sys.argv) - 1} files valid")
    sys.exit(bool(found))
