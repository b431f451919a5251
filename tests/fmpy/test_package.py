"""What other tools check before they run a unit: schema, names, structure, content of the archive."""

import json
import zipfile
from pathlib import Path

import fmpy
import jsonschema
from conftest import FMUS, ROOT
from fmpy.validation import validate_fmu
from lxml import etree


def test_fmpy_finds_nothing(name):
    assert validate_fmu(str(FMUS / f"{name}.fmu")) == []


def test_the_description_is_valid_against_the_schema_of_fmi(name):
    schema = etree.XMLSchema(file=f"{fmpy.__path__[0]}/schema/fmi2/fmi2ModelDescription.xsd")
    with zipfile.ZipFile(FMUS / f"{name}.fmu") as archive:
        schema.assertValid(etree.fromstring(archive.read("modelDescription.xml")))


def test_the_archive_is_complete_and_its_description_is_the_committed_one(name):
    with zipfile.ZipFile(FMUS / f"{name}.fmu") as archive:
        files = set(archive.namelist())
        identifier = name.replace("-", "_")
        assert {
            "modelDescription.xml",
            f"binaries/linux64/{identifier}.so",
            "resources/specification.json",
            "resources/specification.schema.json",
            "documentation/index.html",
        } <= files
        committed = ROOT / "modelDescriptions" / f"{name}.xml"
        assert archive.read("modelDescription.xml").decode() == committed.read_text()
        schema = ROOT / "modelDescriptions" / f"{name}.schema.json"
        assert archive.read("resources/specification.schema.json").decode() == schema.read_text()


def test_the_default_specification_fits_its_schema(name):
    with zipfile.ZipFile(FMUS / f"{name}.fmu") as archive:
        specification = json.loads(archive.read("resources/specification.json"))
        schema = json.loads(archive.read("resources/specification.schema.json"))
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(specification, schema)
    assert specification, "an empty default teaches nobody"


def test_example_systems_are_valid_against_the_schema_of_ssp():
    schema = etree.XMLSchema(file=f"{fmpy.__path__[0]}/ssp/schema/SystemStructureDescription.xsd")
    systems = sorted((ROOT / "examples").glob("*/*.ssd"))
    assert systems
    for path in systems:
        schema.assertValid(etree.parse(str(path)))


def units_of_specifications(folder):
    """Which unit each specification of a study is for, as its systems say: file name -> name of the FMU."""
    units = {}
    for system in folder.glob("*.ssd"):
        for component in etree.parse(system).iter("{*}Component"):
            for parameter in component.iter("{*}Parameter"):
                if parameter.get("name") == "specification":
                    units[parameter[0].get("value")] = Path(component.get("source")).stem
    return units


def test_example_specifications_fit_their_schemas():
    """A specification is its unit's by the systems of the study, or by its name: rig-x.json, or ground-x.json beside a ground.json that is."""
    schemas = {p.name.removesuffix(".schema.json"): json.loads(p.read_text()) for p in (ROOT / "modelDescriptions").glob("*.schema.json")}
    checked = 0
    for path in sorted((ROOT / "examples").glob("*/*.json")):
        units = units_of_specifications(path.parent)
        named = {n: n for n in schemas} | {Path(file).stem: unit for file, unit in units.items()}
        fitting = [n for n in named if path.stem == n or path.stem.startswith(f"{n}-")]
        assert path.name in units or fitting, f"{path}: no system uses it, and its name begins with no unit's ({', '.join(sorted(schemas))})"
        unit = units.get(path.name) or named[max(fitting, key=len)]
        jsonschema.validate(json.loads(path.read_text()), schemas[unit])
        checked += 1
    assert checked
