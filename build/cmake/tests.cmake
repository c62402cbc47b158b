# SPDX-License-Identifier: GPL-3.0-or-later
# tests/FOLDER/test_NAME.c -> target FOLDER_test_NAME, program tests/FOLDER/test_NAME in the binary folder.
# `all_tests` builds them all, `FOLDER_tests` those of a folder, `fuzz_tests` the fuzzers; build/test runs them.
add_custom_target(all_tests)
add_custom_target(fuzz_tests)
add_dependencies(all_tests fuzz_tests)

# Exact rays for the virtual scans; tests/truth/scans/rays.py loads it.
add_library(truth_rays SHARED EXCLUDE_FROM_ALL ${ROOT}/tests/truth/scans/rays.c ${ROOT}/tests/truth/scans/albedo.c)
target_compile_options(truth_rays PRIVATE ${WARNINGS})
target_link_libraries(truth_rays PRIVATE ${SYSTEM})
set_target_properties(truth_rays PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests/truth)
add_dependencies(all_tests truth_rays)

find_library(CMOCKA cmocka)
if(NOT CMOCKA)
    message(STATUS "cmocka not found: no C tests")
    return()
endif()

set(TESTS ${ROOT}/tests)
set(TEST_WARNINGS ${WARNINGS})
file(GLOB SUPPORT_SOURCES CONFIGURE_DEPENDS
    ${TESTS}/*.c ${TESTS}/reference/*.c ${TESTS}/kernels/*.c ${TESTS}/unit/*.c ${TESTS}/scenes/*.c ${TESTS}/hard/*.c)
set(FOLDERS kernels unit scenes hard)
if(CMAKE_SYSTEM_NAME STREQUAL Linux AND NOT PATINA_TARGET)
    list(APPEND FOLDERS soak) # which asks glibc what it holds
endif()
list(FILTER SUPPORT_SOURCES EXCLUDE REGEX "/test_[^/]*\\.c$")
list(FILTER SUPPORT_SOURCES EXCLUDE REGEX "/fuzz/")

add_library(patina_test INTERFACE)
target_include_directories(patina_test INTERFACE ${TESTS} ${TESTS}/kernels ${TESTS}/reference)
target_compile_options(patina_test INTERFACE ${TEST_WARNINGS})
target_compile_definitions(patina_test INTERFACE PT_TEST_ROOT="${ROOT}")
target_link_libraries(patina_test INTERFACE patina_static ${CMOCKA} ${SYSTEM})
if(PATINA_TARGET) # by zig: out/libraries
    find_path(CMOCKA_INCLUDE cmocka.h)
    target_include_directories(patina_test SYSTEM INTERFACE ${CMOCKA_INCLUDE})
endif()
if(SUPPORT_SOURCES)
    add_library(patina_test_support STATIC EXCLUDE_FROM_ALL ${SUPPORT_SOURCES})
    target_link_libraries(patina_test_support PRIVATE patina_test)
endif()

foreach(folder IN LISTS FOLDERS)
    add_custom_target(${folder}_tests)
    add_dependencies(all_tests ${folder}_tests)
    file(GLOB sources CONFIGURE_DEPENDS ${TESTS}/${folder}/test_*.c)
    foreach(source IN LISTS sources)
        get_filename_component(name ${source} NAME_WE)
        set(target ${folder}_${name})
        add_executable(${target} EXCLUDE_FROM_ALL ${source})
        set_target_properties(${target} PROPERTIES
            OUTPUT_NAME ${name} RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests/${folder})
        if(name STREQUAL test_example) # the public header and the shared library alone, as a stranger's program
            target_compile_options(${target} PRIVATE ${TEST_WARNINGS} -Wpedantic -U_GNU_SOURCE)
            target_link_libraries(${target} PRIVATE patina_shared ${SYSTEM})
        else()
            target_include_directories(${target} PRIVATE ${TESTS}/${folder})
            if(folder STREQUAL soak)
                target_sources(${target} PRIVATE ${TESTS}/soak/usage.c)
                target_include_directories(${target} SYSTEM PRIVATE ${NATIVE}/device_gl/glad ${NATIVE}/device_gl/glad/include)
            endif()
            if(SUPPORT_SOURCES)
                target_link_libraries(${target} PRIVATE patina_test_support)
            endif()
            target_link_libraries(${target} PRIVATE patina_test)
        endif()
        if(name STREQUAL test_simd) # as kernels are, of a level that has vectors
            list(LENGTH ISAS count)
            if(count EQUAL 1)
                set(isa scalar)
            else()
                list(GET ISAS 1 isa)
            endif()
            string(TOUPPER ${isa} upper)
            target_compile_definitions(${target} PRIVATE PT_ISA=${isa} PT_ISA_${upper}=1)
            target_compile_options(${target} PRIVATE ${FLAGS_${isa}})
        endif()
        add_dependencies(${folder}_tests ${target})
    endforeach()
endforeach()

# What the bench draws that is too large to be made in memory.
add_executable(bench_town EXCLUDE_FROM_ALL ${TESTS}/bench/town.c)
set_target_properties(bench_town PROPERTIES OUTPUT_NAME town RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests/bench)
target_link_libraries(bench_town PRIVATE patina_test_support patina_test)
add_dependencies(all_tests bench_town)

# How fast a device writes.
add_executable(bench_bandwidth EXCLUDE_FROM_ALL ${TESTS}/bench/bandwidth.c)
set_target_properties(bench_bandwidth PROPERTIES OUTPUT_NAME bandwidth RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests/bench)
target_link_libraries(bench_bandwidth PRIVATE patina_test)
add_dependencies(all_tests bench_bandwidth)

# tests/fuzz/fuzz_NAME.c: libFuzzer targets; without PATINA_FUZZ they only replay a corpus.
file(GLOB sources CONFIGURE_DEPENDS ${TESTS}/fuzz/fuzz_*.c)
if(CMAKE_C_COMPILER_ID MATCHES "Clang" AND PATINA_SANITIZE)
    foreach(source IN LISTS sources)
        get_filename_component(name ${source} NAME_WE)
        add_executable(${name} EXCLUDE_FROM_ALL ${source})
        set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests/fuzz)
        target_compile_options(${name} PRIVATE -Wno-missing-prototypes)
        target_link_options(${name} PRIVATE -fsanitize=fuzzer)
        target_link_libraries(${name} PRIVATE patina_test)
        add_dependencies(fuzz_tests ${name})
    endforeach()
endif()
