# SPDX-License-Identifier: GPL-3.0-or-later
# What build/package --tarball packs: the library with a versioned soname, and a command line that finds it in ../lib. Both consist of
# the objects of the other targets. The soname is libpatina.so.0.MINOR before version 1.0.0, and libpatina.so.MAJOR from then on, because
# these parts of the version decide which programs the library fits (.github/CONTRIBUTING.md, Versions).
file(STRINGS ${NATIVE}/include/patina/patina.h LINES REGEX "#define PATINA_VERSION_")
list(TRANSFORM LINES REPLACE "[^0-9]+" "")
list(GET LINES 0 MAJOR)
list(GET LINES 1 MINOR)
list(JOIN LINES "." VERSION)
if(MAJOR EQUAL 0)
    set(SONAME 0.${MINOR})
else()
    set(SONAME ${MAJOR})
endif()
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${NATIVE}/include/patina/patina.h)

add_library(patina_packed SHARED EXCLUDE_FROM_ALL ${OBJECTS})
set_target_properties(patina_packed PROPERTIES OUTPUT_NAME patina LINKER_LANGUAGE C VERSION ${VERSION} SOVERSION ${SONAME}
    LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/packed/lib)
target_link_libraries(patina_packed PRIVATE ${SYSTEM})
get_target_property(LINKING patina_shared LINK_OPTIONS)
target_link_options(patina_packed PRIVATE ${LINKING})

if(TARGET patina_tool)
    get_target_property(SOURCES patina_tool SOURCES)
    add_executable(patina_tool_packed EXCLUDE_FROM_ALL ${SOURCES})
    target_include_directories(patina_tool_packed PRIVATE ${NATIVE} ${NATIVE}/include)
    target_link_libraries(patina_tool_packed PRIVATE patina_packed PNG::PNG ${SYSTEM})
    set_target_properties(patina_tool_packed PROPERTIES OUTPUT_NAME patina BUILD_RPATH_USE_ORIGIN ON
        RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/packed/bin)
endif()
