# SPDX-License-Identifier: BSD-3-Clause
# Removes the files that an installation's manifest lists.
if(NOT EXISTS ${manifest})
  message(FATAL_ERROR "${manifest} is absent: nothing was installed from this folder")
endif()
file(STRINGS ${manifest} files)
foreach(file IN LISTS files)
  set(path "$ENV{DESTDIR}${file}")
  if(EXISTS "${path}" OR IS_SYMLINK "${path}")
    message(STATUS "Removing ${path}")
    file(REMOVE "${path}")
  endif()
endforeach()
