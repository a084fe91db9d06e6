"""Structure of an HDF5 file before it is read: no data outside the file, and no more data than the file can hold."""

from collections.abc import Container, Iterator

import h5py

from gaitopt.errors import ArchiveError

LARGEST, EXPANSION = 100_000_000, 20
"""Largest size of the data of a file in memory [bytes], to which a multiple of the size of the file is added."""

MOST_OBJECTS = 100_000
"""Largest number of groups and datasets."""


def check_structure(group: h5py.Group, *, omit: Container[str] = ()) -> None:
    """Raise ArchiveError if a group refers to data outside its file, or declares more data than is plausible.

    Parameters
    ----------
    group : h5py.Group
    omit : container of str
        Members of the group that are not examined.

    Raises
    ------
    ArchiveError
        If a member is a soft or external link, a virtual dataset, a dataset with external storage, or a type, or the
        sum of the declared sizes or the number of members is too large.

    Examples
    --------
    >>> with h5py.File("note.h5", "w", driver="core", backing_store=False) as file:
    ...     file["angle"] = h5py.SoftLink("/elsewhere")
    ...     check_structure(file)
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: note.h5 is rejected: /angle is a link to another place or file.
    """
    path, declared = group.file.filename, 0
    allowed = LARGEST + EXPANSION * group.file.id.get_filesize()
    for number, dataset in enumerate(_walk(group, path, omit)):
        if dataset.is_virtual or dataset.id.get_create_plist().get_external_count():
            raise ArchiveError(f"{path} is rejected: the data of {dataset.name} is in another file.")
        declared += (dataset.size or 0) * dataset.dtype.itemsize
        if declared > allowed:
            raise ArchiveError(
                f"{path} is rejected: it has {group.file.id.get_filesize()} bytes, but declares more than "
                f"{allowed / 1e6:.0f} MB of data; {dataset.name} has the shape {dataset.shape}."
            )
        if number > MOST_OBJECTS:
            raise ArchiveError(f"{path} is rejected: it has more than {MOST_OBJECTS} datasets.")


def find_group(group: h5py.Group, place: str) -> h5py.Group | None:
    """Return a group in a group, reached without links to another place or file; None if none exists.

    Examples
    --------
    >>> with h5py.File("note.h5", "w", driver="core", backing_store=False) as file:
    ...     file["gaits/here"] = h5py.ExternalLink("other.h5", "/")
    ...     find_group(file, "gaits/here")
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: note.h5 is rejected: gaits/here is a link to another place or file.
    """
    for name in place.split("/"):
        if name not in group.keys():  # noqa: SIM118 - a group also contains paths
            return None
        _require_hard_link(group, name, place)
        group = group[name]
    return group


def _require_hard_link(group: h5py.Group, name: str, place: str) -> None:
    if not isinstance(group.get(name, getlink=True), h5py.HardLink):
        raise ArchiveError(f"{group.file.filename} is rejected: {place} is a link to another place or file.")


def _walk(group: h5py.Group, path: str, omit: Container[str]) -> Iterator[h5py.Dataset]:
    """Yield all datasets of a group; a group that is a member of several groups is visited once."""
    pending, seen = [group], set()
    while pending:
        parent = pending.pop()
        for name in parent:
            place = f"{parent.name.rstrip('/')}/{name}"
            _require_hard_link(parent, name, place)
            if parent is group and name in omit:
                continue
            member = parent[name]
            address = h5py.h5o.get_info(member.id).addr
            if address in seen:
                continue
            seen.add(address)
            if len(seen) > MOST_OBJECTS:
                raise ArchiveError(f"{path} is rejected: it has more than {MOST_OBJECTS} groups and datasets.")
            if isinstance(member, h5py.Group):
                pending.append(member)
            elif isinstance(member, h5py.Dataset):
                yield member
            else:
                raise ArchiveError(f"{path} is rejected: {place} is neither a group nor a dataset.")
