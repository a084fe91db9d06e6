"""A Ctrl-C while h5netcdf opens a file is deferred; a finaliser that fails would be a warning, thus an error here."""

import gc
import signal

import h5netcdf
import h5py
import pytest
import xarray as xr

from gaitopt.motion.netcdf import load_netcdf, write_netcdf


@pytest.fixture
def interrupted_open(monkeypatch):
    """Interrupt each constructor of an open file, as a held key may do."""
    construct = h5netcdf.File.__init__

    def interrupt(file, *arguments, **named):
        signal.raise_signal(signal.SIGINT)
        construct(file, *arguments, **named)

    return lambda: monkeypatch.setattr(h5netcdf.File, "__init__", interrupt)


def test_interrupted_write_is_complete(interrupted_open, tmp_path):
    table = xr.Dataset({"cost": ("point", [1.0, 2.0])})
    interrupted_open()
    with pytest.raises(KeyboardInterrupt):
        write_netcdf(table, tmp_path / "table.nc", 1000)
    gc.collect()
    with h5py.File(tmp_path / "table.nc") as written:
        assert list(written["cost"]) == [1.0, 2.0]


def test_interrupted_load_leaves_no_file_open(interrupted_open, tmp_path):
    write_netcdf(xr.Dataset({"cost": ("point", [1.0, 2.0])}), tmp_path / "table.nc", 1000)
    interrupted_open()
    with pytest.raises(KeyboardInterrupt):
        load_netcdf(tmp_path / "table.nc")
    gc.collect()
