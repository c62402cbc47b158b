// SPDX-License-Identifier: GPL-3.0-or-later
// Points as lines of numbers: what each column is taken for, scans in their places, what is refused.
#include <patina/patina.h>

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static patina_file *read(const char *text)
{
    patina_file *file = NULL;
    char message[256] = "";
    if (patina_file_open_memory(text, strlen(text), &file)) {
        patina_message(NULL, message, sizeof message);
        fail_msg("%s", message);
    }
    return file;
}

static patina_file_info info_of(const patina_file *file)
{
    patina_file_info info = {.struct_size = sizeof info};
    assert_int_equal(patina_file_get_info(file, &info), PATINA_OK);
    return info;
}

static void expect(const char *text, const char *format, uint64_t count, uint32_t color_type, uint32_t normals,
                   const char *attributes)
{
    patina_file *file = read(text);
    patina_file_info info = info_of(file);
    char names[256] = "";
    for (uint32_t i = 0; i < info.attributes; i++) {
        patina_file_attribute attribute = {.struct_size = sizeof attribute};
        assert_int_equal(patina_file_get_attribute(file, i, &attribute), PATINA_OK);
        snprintf(names + strlen(names), sizeof names - strlen(names), "%s%s", i ? " " : "", attribute.name);
    }
    assert_string_equal(info.format, format);
    assert_int_equal(info.count, count);
    assert_int_equal(info.color_type, color_type);
    assert_int_equal(info.has_normals, normals);
    assert_string_equal(names, attributes);
    patina_file_destroy(file);
}

static void test_columns(void **state)
{
    (void)state;
    expect("1 2 3\n4 5 6\n", "XYZ", 2, PATINA_NONE, 0, "");
    expect("# a comment\n\n1 2 3 0.5\r\n4 5 6 0.25\r\n", "XYZ", 2, PATINA_NONE, 0, "intensity");
    expect("1 2 3 255 0 9\n4 5 6 1 2 3\n", "XYZ", 2, PATINA_UINT8, 0, "");
    expect("1 2 3 65535 0 9\n4 5 6 1 2 3", "XYZ", 2, PATINA_UINT16, 0, "");
    expect("1 2 3 0.5 0 0.25\n", "XYZ", 1, PATINA_FLOAT32, 0, "");
    expect("1 2 3 0 0 1\n4 5 6 0.6 0.8 0\n", "XYZ", 2, PATINA_NONE, 1, "");
    expect("1,2,3,10,20,30,0,0,1\n", "XYZ", 1, PATINA_UINT8, 1, "");
    expect("1 2 3 0 1 0 10 20 30\n", "XYZ", 1, PATINA_UINT8, 1, "");
    expect("1 2 3 7 8\n", "XYZ", 1, PATINA_NONE, 0, "column_4 column_5");
    expect("2\n1 2 3 -120 1 2 3\n4 5 6 -7 1 2 3\n", "PTS", 2, PATINA_UINT8, 0, "intensity");
    expect("1\n1 2 3\n1\n4 5 6\n", "PTS", 2, PATINA_NONE, 0, "");
    expect("time;\"X\";Y;z;Red;green;blue;class\n1;2;3;4;5;6;7;8\n", "CSV", 1, PATINA_UINT8, 0, "time class");
    expect("x,y,z,nx,ny\n1,2,3,0,1\n", "CSV", 1, PATINA_NONE, 0, "nx ny");
}

static void test_values(void **state)
{
    (void)state;
    patina_file *file = read("x y z r g b gps\n500000.125 4100000.25 7 1 2 3 0.5\n500001.125 4100001.25 8 4 5 6 1.5\n");
    patina_file_info info = info_of(file);
    float xyz[6], gps[2];
    uint8_t rgba[8];
    assert_int_equal(patina_file_read_positions(file, xyz, sizeof xyz), PATINA_OK);
    assert_true(info.origin[0] + xyz[0] == 500000.125 && info.origin[1] + xyz[1] == 4100000.25 && xyz[3] - xyz[0] == 1);
    assert_int_equal(patina_file_read_colors_u8(file, rgba, sizeof rgba), PATINA_OK);
    assert_memory_equal(rgba, ((const uint8_t[]){1, 2, 3, 255, 4, 5, 6, 255}), 8);
    assert_int_equal(patina_file_read_attribute(file, 0, gps, sizeof gps), PATINA_OK);
    assert_true(gps[0] == 0.5f && gps[1] == 1.5f);
    patina_file_destroy(file);
}

// Positions and the last attribute of a file, all of it to compare with.
static void expect_rows(const char *text, const char *format, uint64_t count, const char *last, const double *wanted)
{
    patina_file *file = read(text);
    patina_file_info info = info_of(file);
    float xyz[12], values[4];
    assert_true(count <= 4);
    assert_string_equal(info.format, format);
    assert_int_equal(info.count, count);
    assert_int_equal(patina_file_read_positions(file, xyz, count * 3 * sizeof *xyz), PATINA_OK);
    assert_int_equal(info.attributes, last ? 1 : 0);
    if (last) {
        patina_file_attribute attribute = {.struct_size = sizeof attribute};
        assert_int_equal(patina_file_get_attribute(file, 0, &attribute), PATINA_OK);
        assert_string_equal(attribute.name, last);
        assert_int_equal(patina_file_read_attribute(file, 0, values, count * sizeof *values), PATINA_OK);
    }
    for (uint64_t i = 0; i < count; i++)
        for (int k = 0; k < (last ? 4 : 3); k++) {
            double found = k < 3 ? (double)xyz[3 * i + (uint64_t)k] + info.origin[k] : (double)values[i], want = *wanted++;
            if (!(fabs(found - want) < 1e-6) && !(isnan(found) && isnan(want)))
                fail_msg("'%s': row %d, column %d is %g, not %g", text, (int)i, k, found, want);
        }
    patina_file_destroy(file);
}

// A table as spreadsheets write it where decimals stand behind a comma, by semicolons, tabs, blanks, or in quotes.
static void test_decimal_commas(void **state)
{
    (void)state;
    const double wanted[8] = {2.05164, 0.143959, -0.918971, 7, -1, 2.5, 3, 0.25};
    expect_rows("X;Y;Z;Wert\n2,051640;0,143959;-0,918971;7\n-1;2,5;3;0,25\n", "CSV", 2, "Wert", wanted);
    expect_rows("X\tY\tZ\tWert\n2,051640\t0,143959\t-0,918971\t7\n-1\t2,5\t3\t0,25\n", "CSV", 2, "Wert", wanted);
    expect_rows("x y z Wert\n2,051640 0,143959 -0,918971 7\n-1   2,5 3 0,25\n", "CSV", 2, "Wert", wanted);
    expect_rows("\"X\",\"Y\",\"Z\",\"Wert\"\r\n\"2,051640\",\"0,143959\",\"-0,918971\",7\r\n-1,\"2,5\",\"3\",\"0,25\"\r\n",
                "CSV", 2, "Wert", wanted);
    expect_rows("2,051640;0,143959;-0,918971;7;\n-1;2,5;3;2,5e-1;\n", "XYZ", 2, "intensity", wanted);
    expect_rows("2,051640 0,143959 -0,918971 7\n-1 2,5 3 0,25\n", "XYZ", 2, "intensity", wanted);
    const double points[8] = {1.5, 2, 3, 4, 5, 6, 7.25, 8};
    expect_rows("x;y;z;t\n1.5;2;3;4\n5;6;7.25;8\n", "CSV", 2, "t", points);
    expect_rows("1.5, 2, 3, 4\n5, 6, 7.25, 8\n", "XYZ", 2, "intensity", points);
    expect_rows("1.5,2 3;4\n5,6 7.25;8\n", "XYZ", 2, "intensity", points); // whatever parts them
}

// Quotes are taken off, an empty cell is not known, lines of nothing but separators end a table, tabs may align.
static void test_tables(void **state)
{
    (void)state;
    const double wanted[8] = {1, 2, 3, NAN, 4, 5, 6, 0.5};
    expect_rows("x,y,z,Intensity\n1,2,3,\n4,5,6,0.5\n,,,\n", "CSV", 2, "Intensity", wanted);
    expect_rows("\"x\";\"y\";\"z\";\"Scan Angle\"\n\"1.0\";\"2.0\";\"3.0\";\"\"\n\"4\";\"5\";\"6\";\"0.5\"\n", "CSV", 2,
                "Scan Angle", wanted);
    expect_rows("\"1.0\",\"2.0\",\"3.0\",\n4,5,6,0.5\n", "XYZ", 2, "intensity", wanted);
    const double indexed[8] = {1, 2, 3, 0, 4, 5, 6, 1};
    expect_rows(",x,y,z\n0,1,2,3\n1,4,5,6\n", "CSV", 2, "column_1", indexed);
    const double aligned[6] = {1, 2, 3, 4, 5, 6};
    expect_rows("1\t\t2\t\t3\n4\t\t5\t\t6\n", "XYZ", 2, NULL, aligned);
}

// All warnings since the last call, a line each.
static const char *take_log(void)
{
    static char log[2048];
    char text[512];
    int level;
    for (log[0] = 0; patina_log_next(text, sizeof text, &level);)
        if (level == 1)
            snprintf(log + strlen(log), sizeof log - strlen(log), "%s\n", text);
    return log;
}

// Columns of words are left out, and named: where a first line names x, y and z, or the first row has words there itself.
static void test_words(void **state)
{
    (void)state;
    const double wanted[8] = {1.5, 2, 3, 7, 4, 5, 6, 8}, places[6] = {1.5, 2, 3, 4, 5, 6};
    take_log();
    expect_rows("X,Y,Z,Note\n1.5,2,3,tree\n4,5,6,\"a, post\"\n", "CSV", 2, NULL, places);
    assert_non_null(strstr(take_log(), "column 'Note' holds words ('tree' in line 2) and is left out"));
    expect_rows("\xEF\xBB\xBF"
                "Name;X;Y;Z;Code;Wert\r\nP 1;1,5;2;3;;7\r\n12;4;5;6;oak tree;8\r\n;;;;;\r\n",
                "CSV", 2, "Wert", wanted);
    const char *said = take_log();
    assert_non_null(strstr(said, "column 'Name' holds words ('P 1' in line 2)"));
    assert_non_null(strstr(said, "column 'Code' holds words ('oak tree' in line 3)"));
    expect_rows("id x y z wert\nP1 1.5 2 3 7\nP2 4 5 6 8\n", "CSV", 2, "wert", wanted);
    expect_rows("1.5,2,3,7,tree\n4,5,6,8,a post\n", "XYZ", 2, "intensity", wanted);
    take_log();
    expect_rows("1.5,P1,2,3,7,a\n4,P2,5,6,8,b\n", "XYZ", 2, "intensity", wanted);
    assert_non_null(strstr(take_log(), "column 2 holds words ('P1' in line 1) and is left out"));
    expect("1 2 3 P1 10 20 255\n4 5 6 P2 7 8 9\n", "XYZ", 2, PATINA_UINT8, 0, "");
    expect("Note,X,Y,Z,nx,ny,nz\ntree,1,2,3,0,0,1\n", "CSV", 1, PATINA_NONE, 1, "");
}

static void refuse(const char *text, const char *part)
{
    patina_file *file = NULL;
    char message[256] = "";
    assert_int_equal(patina_file_open_memory(text, strlen(text), &file), PATINA_ERROR_FORMAT);
    patina_message(NULL, message, sizeof message);
    if (!strstr(message, part))
        fail_msg("'%s' is not in '%s'", part, message);
}

// Wherever the first word of a column stands, it is left out: point numbers with one of them 3A.
static void test_words_met_late(void **state)
{
    (void)state;
    const double wanted[6] = {1, 2, 3, 1, 2, 4};
    take_log();
    expect_rows("Name,X,Y,Z\n1,1,2,3\n2A,1,2,4\n", "CSV", 2, NULL, wanted);
    assert_non_null(strstr(take_log(), "column 'Name' holds words ('2A' in line 3) and is left out"));
    const double four[12] = {1, 2, 3, 1, 2, 4, 2, 2, 3, 4, 5, 6};
    expect_rows("Name,X,Y,Z\n1,1,2,3\n2,1,2,4\n3A,2,2,3\n4,4,5,6\n", "CSV", 4, NULL, four);
    expect_rows("X Y Z Name\n1 2 3 1\n1 2 4 2\n2 2 3 3A\n4 5 6 4\n", "CSV", 4, NULL, four);
    expect_rows("Id,X,Y,Z,Code\n1,1,2,3,7\n2,1,2,4,a\n3A,2,2,3,8\n4,4,5,6,9\n", "CSV", 4, NULL, four);
}

// One word among many numbers is an empty cell; so are cells that say that they are.
static void test_stray_words(void **state)
{
    (void)state;
    enum { ROWS = 300 };
    static char text[ROWS * 32];
    static float values[ROWS];
    char *end = text + sprintf(text, "X,Y,Z,Wert\n");
    for (int i = 0; i < ROWS; i++)
        end += i == 200 ? sprintf(end, "%d,2,3,#DIV/0!\n", i) : sprintf(end, "%d,2,3,%d\n", i, i);
    take_log();
    patina_file *file = read(text);
    assert_int_equal(info_of(file).count, ROWS);
    assert_int_equal(info_of(file).attributes, 1);
    assert_int_equal(patina_file_read_attribute(file, 0, values, sizeof values), PATINA_OK);
    for (int i = 0; i < ROWS; i++)
        assert_true(i == 200 ? isnan(values[i]) : values[i] == (float)i);
    assert_non_null(strstr(take_log(), "column 'Wert' holds 1 word among its numbers ('#DIV/0!' in line 202), taken as empty"));
    patina_file_destroy(file);
    const double wanted[16] = {1, 2, 3, NAN, 1, 2, 4, 5, 1, 2, 5, NAN, 1, 2, 6, NAN};
    expect_rows("x,y,z,w\n1,2,3,-\n1,2,4,5\n1,2,5,n/a\n1,2,6,NaN\n", "CSV", 4, "w", wanted);
    assert_string_equal(take_log(), "");
    refuse("x,y,z,w\n1,2,3,4\n1,2,n/a,5\n", "line 3: column 'z' holds a word");
}

// Without names, a first column that counts up by one before four others and a word numbers the points.
static void test_point_numbers(void **state)
{
    (void)state;
    const double wanted[9] = {54.5, 45.25, 3, 55.5, 46.25, 4, 56.5, 47.25, 5}, four[4] = {1, 54.5, 45.25, 3};
    take_log();
    expect_rows("1000,54.5,45.25,3,TREE\n1001,55.5,46.25,4,TREE\n1002,56.5,47.25,5,WALL\n", "XYZ", 3, NULL, wanted);
    assert_non_null(
        strstr(take_log(), "column 1 counts up by one: point numbers, left out; x, y and z are taken from columns 2, 3 and 4"));
    expect_rows("1 54.5 45.25 3 TREE\n", "XYZ", 1, "intensity", four); // one row counts nothing
    assert_non_null(strstr(take_log(), "x, y and z are taken from columns 1, 2 and 3"));
    expect("1,54,45,3\n2,55,46,4\n3,56,47,5\n", "XYZ", 3, PATINA_NONE, 0, "intensity");
    expect("1,54,45,TREE\n2,55,46,TREE\n3,56,47,TREE\n", "XYZ", 3, PATINA_NONE, 0, "");
    expect("1,5,5,3,a\n2,5,6,4,a\n4,5,7,5,a\n", "XYZ", 3, PATINA_NONE, 0, "intensity");
}

// Headers as surveys and spreadsheets write them.
static void test_headers(void **state)
{
    (void)state;
    static const char *const headers[] = {"X [m],Y [m],Z [m]",
                                          "X (m),Y (m),Z (m)",
                                          "Easting(m),Northing(m),Height(m)",
                                          "E,N,H",
                                          "XCOORD,YCOORD,ZCOORD",
                                          "pos_x,pos_y,pos_z",
                                          "x_coord,y_coord,z_coord",
                                          "Rechtswert,Hochwert,H\xC3\xB6he",
                                          "Rechtswert,Hochwert,H\xF6he",
                                          "sep=,\nX,Y,Z",
                                          "sep=,\r\nX,Y,Z"};
    const double wanted[6] = {1.5, 2, 3, 4, 5, 6};
    for (size_t i = 0; i < sizeof headers / sizeof *headers; i++) {
        char text[128];
        snprintf(text, sizeof text, "%s\n1.5,2,3\n4,5,6\n", headers[i]);
        expect_rows(text, "CSV", 2, NULL, wanted);
    }
    expect("n,x,y,z,h,e\n1,2,3,4,5,6\n", "CSV", 1, PATINA_NONE, 0, "n h e");
    expect("X [m];Y [m];Z [m];R (0-255);G;B\n1;2;3;4;5;6\n", "CSV", 1, PATINA_UINT8, 0, "");
}

// A note within quotes may hold line ends, and quotes of its own; lines are counted on.
static void test_quoted_lines(void **state)
{
    (void)state;
    const double wanted[6] = {1, 2, 3, 4, 5, 6};
    take_log();
    expect_rows("Name,X,Y,Z,Note\nP0,1,2,3,\"two\nlines\"\nP1,4,5,6,\"two\r\nlines, and\nmore\"\n", "CSV", 2, NULL, wanted);
    assert_non_null(strstr(take_log(), "('two lines' in line 2)"));
    expect_rows("\"Name\";X;Y;Z\n\"Tree \"\"big\"\" 0\";1;2;3\n\"a \"\"b\"\"\";4;5;6\n", "CSV", 2, NULL, wanted);
    assert_non_null(strstr(take_log(), "'Tree \"big\" 0'"));
    refuse("X,Y,Z,Note\n1,2,3,\"two\nlines\"\n1,2,tree,b\n", "line 4: column 'Z' holds a word");
    expect_rows("X,Y,Z,Note\n1,2,3,\"inch\n4,5,6,b\n", "CSV", 2, NULL, wanted);
}

// A first row without a place is a row like another, and says nothing of what the columns are.
static void test_first_row_of_nan(void **state)
{
    (void)state;
    const double wanted[6] = {NAN, NAN, NAN, 4, 5, 6};
    expect_rows("nan nan nan\n4 5 6\n", "XYZ", 2, NULL, wanted);
    expect_rows("NaN,NaN,NaN\n4,5,6\n", "XYZ", 2, NULL, wanted);
    expect("nan nan nan nan nan nan\n4 5 6 0 0.6 0.8\n7 8 9 1 0 0\n", "XYZ", 3, PATINA_NONE, 1, "");
    expect("inf 1 2\n4 5 6\n", "XYZ", 2, PATINA_NONE, 0, "");
}

// Two scans: the second is turned by 90 degrees around z and moved; a beam that met nothing is left out.
static void test_ptx(void **state)
{
    (void)state;
    patina_file *file = read("1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n10 0 0 1\n"
                             "1 2 3 0.5 255 128 0\n0 0 0 0.5 0 0 0\n"
                             "1\n1\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 1 0 0\n-1 0 0 0\n0 0 1 0\n0 0 5 1\n"
                             "1 0 0 0.25 1 1 1\n");
    patina_file_info info = info_of(file);
    float xyz[6], intensity[2], scan[2];
    assert_string_equal(info.format, "PTX");
    assert_int_equal(info.count, 2);
    assert_int_equal(info.color_type, PATINA_UINT8);
    assert_int_equal(patina_file_read_positions(file, xyz, sizeof xyz), PATINA_OK);
    const double wanted[6] = {11, 2, 3, 0, 1, 5};
    for (int k = 0; k < 6; k++)
        assert_true(fabs((double)xyz[k] + info.origin[k % 3] - wanted[k]) < 1e-6);
    assert_int_equal(patina_file_read_attribute(file, 0, intensity, sizeof intensity), PATINA_OK);
    assert_int_equal(patina_file_read_attribute(file, 1, scan, sizeof scan), PATINA_OK);
    assert_true(intensity[0] == 0.5f && intensity[1] == 0.25f && scan[0] == 0.0f && scan[1] == 1.0f);
    patina_file_destroy(file);
}

#define PTX_HEAD(columns, rows, matrix) columns "\n" rows "\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n" matrix
#define PTX_PLAIN "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"

// Opens a PTX, expects so many points of these scans, and a warning that holds these words.
static void expect_scans(const char *text, size_t points, const float *wanted, const char *words)
{
    take_log();
    patina_file *file = read(text);
    float scan[16];
    assert_int_equal(info_of(file).count, points);
    assert_int_equal(patina_file_read_attribute(file, 1, scan, sizeof scan), PATINA_OK);
    for (size_t i = 0; i < points; i++)
        assert_true(scan[i] == wanted[i]);
    const char *said = take_log();
    if (words ? !strstr(said, words) : *said)
        fail_msg("'%s' is not in '%s'", words ? words : "nothing", said);
    patina_file_destroy(file);
}

// What is wrong with a scan is told by its number; the others are there, and what it has itself.
static void test_bad_scans(void **state)
{
    (void)state;
    static const char good[] = PTX_HEAD("1", "2", PTX_PLAIN) "1 2 3 0.5\n4 5 6 0.5\n";
    char text[2048];
    const float both[] = {0, 0, 1, 1}, last[] = {1, 1}, one[] = {0, 1, 1}, first[] = {0, 0};
    snprintf(text, sizeof text, "%s%s", PTX_HEAD("3", "2", PTX_PLAIN) "1 2 3 0.5\n1 2 4 0.5\n", good);
    expect_scans(text, 4, both, "scan 0 ends 4 cells before its grid of 3 x 2");
    snprintf(text, sizeof text, "%s%s", PTX_HEAD("1", "2", PTX_PLAIN) "1 2 3 0.5\n1 2 4 0.5\n9 9 9 1\n9 9 9 1\n", good);
    expect_scans(text, 4, both, "scan 0: 2 lines behind its grid of 1 x 2 are left out");
    snprintf(text, sizeof text, "%s%s", PTX_HEAD("1", "2", "0 0 0 0\n0 0 0 0\n0 0 0 0\n0 0 0 1\n") "1 2 3 0.5\n1 2 4 0.5\n",
             good);
    expect_scans(text, 2, last, "scan 0 is left out: its matrix");
    snprintf(text, sizeof text, "%s%s", PTX_HEAD("1", "2", "1 0 0 0\n0.5 1 0 0\n0 0 1 0\n0 0 0 1\n") "1 2 3 0.5\n1 2 4 0.5\n",
             good);
    expect_scans(text, 2, last, "scan 0 is left out: its matrix");
    snprintf(text, sizeof text, "%s%s", PTX_HEAD("1", "1", "1 0 0 0\n0 1 0 0\n0 0 1 0\nnan 0 0 1\n") "1 2 3 0.5\n", good);
    expect_scans(text, 2, last, "scan 0 is left out: its matrix");
    snprintf(text, sizeof text, "%s%s", PTX_HEAD("1", "2", PTX_PLAIN) "0 0 0 0.5\n0 0 0 0.5\n", good);
    expect_scans(text, 2, last, "scan 0 has no points");
    snprintf(text, sizeof text, "%s%s", PTX_HEAD("1", "2", PTX_PLAIN) "0 0 0 0.5\n7 0 0 0.5\n", good);
    expect_scans(text, 3, one, "scan 0 has one point");
    snprintf(text, sizeof text, "%s%s", good, PTX_HEAD("70000", "50000", PTX_PLAIN) "1 2");
    expect_scans(text, 2, first, "scan 1 ends 3500000000 cells before its grid of 70000 x 50000");
    expect_scans(good, 2, first, NULL);
}

// Several scans with one fault give one warning.
static void test_bad_scans_are_joined(void **state)
{
    (void)state;
    static const char bad[] = PTX_HEAD("1", "2", "0 0 0 0\n0 0 0 0\n0 0 0 0\n0 0 0 1\n") "1 2 3 0.5\n1 2 4 0.5\n";
    static const char cut[] = PTX_HEAD("3", "2", PTX_PLAIN) "1 2 3 0.5\n1 2 4 0.5\n";
    char text[4096] = PTX_HEAD("1", "2", PTX_PLAIN) "1 2 3 0.5\n4 5 6 0.5\n";
    const float first[] = {0, 0}, several[] = {0, 0, 7, 7, 8, 8};
    for (int i = 0; i < 6; i++)
        strcat(text, bad);
    expect_scans(text, 2, first, "6 scans are left out, because their matrices are none of a pose: scans 1, 2, 3, 4, 5, ...\n");
    strcat(text, cut);
    strcat(text, cut);
    expect_scans(text, 6, several, "2 scans end before their grids do, by 8 cells in all: scans 7, 8\n");
}

// A head whose numbers no grid has, or whose lines are not a head's, is told by scan and line: it must not become points.
static void test_bad_heads(void **state)
{
    (void)state;
    static const char *const sizes[][2] = {{"-1", "5"},
                                           {"5", "-1"},
                                           {"4294967296", "4294967296"},
                                           {"1000000000", "1000000000"},
                                           {"1e30", "1"},
                                           {"nan", "inf"},
                                           {"1.5", "2"},
                                           {"65536", "65536"}};
    static const char good[] = PTX_HEAD("1", "2", PTX_PLAIN) "1 2 3 0.5\n4 5 6 0.5\n",
                      rest[] = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n" PTX_PLAIN;
    char text[1024];
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        snprintf(text, sizeof text, "%s\n%s\n%s1 2 3 0.5\n2 3 4 0.5\n", sizes[i][0], sizes[i][1], rest);
        refuse(text, "line 1: scan 0 announces a grid of ");
        snprintf(text, sizeof text, "%s%s\n%s\n%s1 2 3 0.5\n2 3 4 0.5\n", good, sizes[i][0], sizes[i][1], rest);
        refuse(text, "line 13: scan 1 announces a grid of ");
    }
    refuse("2\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0\n0 1 0 0\n1 2 3 0.5\n", "line 7: the head of scan 0 is broken");
    refuse("2\n2\n0 0 0 0\n1 2 3 0.5\n", "line 3: the head of scan 0 is broken");
}

// A PTS that holds another number of points than it announces has those that are there, and a warning with both numbers.
static void test_announced_points(void **state)
{
    (void)state;
    static const struct {
        const char *text, *said;
    } cases[] = {{"1000000000\n1 2 3 4 5 6 7\n", "line 1 announces 1000000000 points, the file holds 1\n"},
                 {"-5\n1 2 3 4 5 6 7\n", "line 1 announces -5 points, the file holds 1\n"},
                 {"nan\n1 2 3 4 5 6 7\n", "announces nan points"},
                 {"1\n1 2 3 4 5 6 7\n1 2 3 4 5 6 7\n", "line 1 announces 1 points, the file holds 2\n"},
                 {"1\n1 2 3 4 5 6 7\n2\n1 2 3 4 5 6 7\n3 2 3 4 5 6 7\n", NULL}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        take_log();
        patina_file_destroy(read(cases[i].text));
        const char *said = take_log();
        if (cases[i].said ? !strstr(said, cases[i].said) : *said)
            fail_msg("'%s' is not in '%s'", cases[i].said ? cases[i].said : "nothing", said);
    }
}

// What the scans themselves are: place, direction and interval of each.
static void test_scans_of_ptx(void **state)
{
    (void)state;
    char text[4096];
    int at = snprintf(text, sizeof text, "%s", PTX_HEAD("3", "4", "0 1 0 0\n-1 0 0 0\n0 0 1 0\n500 0 7 1\n"));
    for (int i = 0; i < 12; i++) // a wall 8 away along x, which the matrix turns to y
        at += snprintf(text + at, sizeof text - (size_t)at, "8 %g %g 0.5\n", (i / 4 - 1) * 0.1, (i % 4 - 1.5) * 0.1);
    snprintf(text + at, sizeof text - (size_t)at, "%s", PTX_HEAD("1", "2", PTX_PLAIN) "1 0 0 1\n-1 0 0 1\n");
    patina_file *file = read(text);
    patina_file_scan scan = {.struct_size = sizeof scan};
    assert_int_equal(info_of(file).scans, 2);
    assert_int_equal(patina_file_get_scan(file, 0, &scan), PATINA_OK);
    assert_true(scan.first == 0 && scan.count == 12 && scan.columns == 3 && scan.rows == 4 && scan.has_station &&
                !scan.name[0]);
    assert_true(scan.station[0] == 500 && scan.station[1] == 0 && scan.station[2] == 7);
    assert_true(fabs(scan.direction[0]) < 1e-3 && scan.direction[1] > 0.999 && fabs(scan.direction[2]) < 1e-3);
    assert_true(fabs(scan.interval - 0.1) < 1e-4);
    assert_true(scan.pose[1] == -1 && scan.pose[4] == 1 && scan.pose[10] == 1 && scan.pose[3] == 500 && scan.pose[11] == 7);
    assert_int_equal(patina_file_get_scan(file, 1, &scan), PATINA_OK);
    assert_true(scan.first == 12 && scan.direction[0] == 0 && scan.direction[1] == 0 && scan.direction[2] == 0); // all around
    assert_int_equal(patina_file_get_scan(file, 2, &scan), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_file_get_scan(file, 0, NULL), PATINA_ERROR_ARGUMENT);
    patina_file_destroy(file);
    file = read("1 2 3\n");
    assert_int_equal(info_of(file).scans, 0);
    patina_file_destroy(file);
}

enum { COLUMNS = 60, ROWS = 40 };

// A wall at y = 5 seen from the middle of its scanner, a column of the grid at a time; a board before its middle. The
// distance errs by up to 4 mm either way. Returns the text's new end.
static char *put_wall(char *text, double x, double y, uint32_t *random)
{
    text += sprintf(text, "%d\n%d\n%g %g 2\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n%g %g 2 1\n", COLUMNS, ROWS, x, y,
                    x, y);
    for (int column = 0; column < COLUMNS; column++)
        for (int row = 0; row < ROWS; row++) {
            double u = (column - COLUMNS / 2) * 0.01, v = (row - ROWS / 2) * 0.01, depth = abs(column - 30) < 10 ? 3 : 5;
            *random = *random * 1664525u + 1013904223u;
            depth += 0.008 * ((*random >> 8) / 16777216.0 - 0.5);
            text += row == 7 && column == 3 ? sprintf(text, "0 0 0 0\n")
                                            : sprintf(text, "%.5f %.5f %.5f 0.5\n", u * depth, depth, v * depth);
        }
    return text;
}

// Row, column, scan and station of each point; normals out of the grid face the scanner, at the board's edges too.
static void test_ptx_grid(void **state)
{
    (void)state;
    enum { POINTS = COLUMNS * ROWS - 1 };
    char *text = malloc(2 * COLUMNS * ROWS * 40u);
    uint32_t random = 7;
    assert_non_null(text);
    put_wall(put_wall(text, 500000, 20, &random), 500003, -1, &random);
    patina_file *file = read(text);
    patina_file_info info = info_of(file);
    double stations[6];
    static float n[2 * POINTS * 3], scan[2 * POINTS], column[2 * POINTS], row[2 * POINTS];
    assert_true(info.count == 2 * POINTS && info.has_normals && info.stations == 2);
    assert_int_equal(patina_file_read_stations(file, stations, sizeof stations - 1), PATINA_ERROR_ARGUMENT);
    assert_int_equal(patina_file_read_stations(file, stations, sizeof stations), PATINA_OK);
    assert_true(stations[0] == 500000 && stations[1] == 20 && stations[2] == 2 && stations[3] == 500003 && stations[4] == -1);
    assert_int_equal(patina_file_read_attribute(file, 1, scan, sizeof scan), PATINA_OK);
    assert_int_equal(patina_file_read_attribute(file, 2, column, sizeof column), PATINA_OK);
    assert_int_equal(patina_file_read_attribute(file, 3, row, sizeof row), PATINA_OK);
    assert_int_equal(patina_file_read_normals(file, n, sizeof n), PATINA_OK);
    int far = 0;
    for (int i = 0; i < 2 * POINTS; i++) {
        int cell = i % POINTS + (i % POINTS >= 3 * ROWS + 7);
        assert_true(scan[i] == (float)(i / POINTS) && column[i] == (float)(cell / ROWS) && row[i] == (float)(cell % ROWS));
        assert_true(n[3 * i + 1] < -0.9f); // towards the scanner, within 26 degrees
        far += n[3 * i + 1] > -0.995f;     // beyond 6 degrees
    }
    assert_true(far < POINTS / 50);
    patina_file_destroy(file);
    free(text);
}

// The same for arrays of a caller's; numbers that make no grid of the points give no normals, and take no memory.
static void test_grid_normals(void **state)
{
    (void)state;
    float position[9][3], n[9][3];
    uint32_t column[9], row[9];
    for (uint32_t i = 0; i < 9; i++) {
        column[i] = i / 3, row[i] = i % 3;
        position[i][0] = (float)column[i], position[i][1] = 7, position[i][2] = (float)row[i];
    }
    patina_grid_desc desc = {
        .struct_size = sizeof desc, .count = 9, .position = position[0], .column = column, .row = row, .station = {1, 20, 1}};
    assert_int_equal(patina_grid_normals(&desc, NULL, n[0]), PATINA_OK);
    for (int i = 0; i < 9; i++)
        assert_true(n[i][0] == 0 && n[i][1] == 1 && n[i][2] == 0);
    column[4] = UINT32_MAX, row[5] = 4000000000u;
    assert_int_equal(patina_grid_normals(&desc, NULL, n[0]), PATINA_OK);
    assert_true(n[0][1] == 0);
    desc.count = 0;
    assert_int_equal(patina_grid_normals(&desc, NULL, NULL), PATINA_OK);
    desc.count = 9;
    assert_int_equal(patina_grid_normals(&desc, NULL, NULL), PATINA_ERROR_ARGUMENT);
    desc.struct_size = 0;
    assert_int_equal(patina_grid_normals(&desc, NULL, n[0]), PATINA_ERROR_ARGUMENT);
}

// The same of a file on disk, whose name says what it is meant to be.
static void refuse_file(const char *name, const char *text, const char *part)
{
    const char *folder = getenv("TMPDIR");
    char path[512], message[512] = "";
    snprintf(path, sizeof path, "%s/%s", folder ? folder : "/tmp", name);
    FILE *stream = fopen(path, "w");
    assert_non_null(stream);
    assert_true(fputs(text, stream) >= 0 && fclose(stream) == 0);
    patina_file *file = NULL;
    assert_int_not_equal(patina_file_open(path, NULL, &file), PATINA_OK);
    remove(path);
    patina_message(NULL, message, sizeof message);
    if (!strstr(message, part))
        fail_msg("'%s' is not in '%s'", part, message);
}

static void test_refused(void **state)
{
    (void)state;
    refuse("1 2 3\n4 5\n", "line 2: 2 numbers; 3 were expected");
    refuse("1 2 3\n\n4 5 red\n",
           "line 3: column 3 holds a word, 'red', where a number is needed; a first line that names x, y, z");
    refuse("1 2\n3 4\n", "fewer than three numbers");
    refuse("hello world\n", "not a PLY file");
    refuse("X,Y,Z\n2,051640,0,143959,-0,918971\n", "decimal commas cannot be told apart");
    refuse("X;Y;Z\n1.234,5;2;3\n", "line 2: column 'X' holds a word, '1.234,5', where a number is needed");
    refuse("X,Y,Z,Red,Green,Blue\n1,2,3,4,5,6\n1,2,3,4,n/a,6\n", "line 3: column 'Green' holds a word, 'n/a'");
    refuse("X,Y,Z,Note\n1,2,3,tree\n1,2,tree,4\n", "line 3: column 'Z' holds a word, 'tree'");
    refuse("X Y Z Note\n1 2 3 tree\n1 2 3 a tree\n", "line 3: 5 words; 4 were expected");
    refuse("Point Id X Y Z Code\nP1 1 2 3 7\n", "line 2: fewer words than names: which column is which cannot be told");
    refuse("Name X Y Z\nP 1 1 2 3\nP 2 1 2 4\n", "line 2: more words than names");
    refuse("Name,X,Y,Z\na,\"456,789.784\",\"5,412,343.884\",-1.5\nb,1,2,3\n", "marks between thousands are not read");
    refuse("\xFF\xFEX", "a text in UTF-16, which is not read; save it as CSV UTF-8");
    refuse("1 P1 2 3\n4 P2 five 6\n", "line 2: column 3 holds a word, 'five'");
    refuse("X;Y;Z\n1.5;2;3\n1,5;2;3\n", "line 3: decimals behind a comma");
    refuse_file("patina_text.csv", "id,lon,lat,elev\n1,2,3,4\n",
                "no columns x, y and z in its line of names: id, lon, lat, elev");
    refuse_file("patina_text.txt", "Dear all, this is a letter\nwithout points\n", "names: Dear, all, this");
    refuse_file("patina_text.xyz", "hello world\n", "neither a PLY file nor lines of numbers");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_columns),
        cmocka_unit_test(test_values),
        cmocka_unit_test(test_decimal_commas),
        cmocka_unit_test(test_tables),
        cmocka_unit_test(test_words),
        cmocka_unit_test(test_first_row_of_nan),
        cmocka_unit_test(test_bad_scans),
        cmocka_unit_test(test_scans_of_ptx),
        cmocka_unit_test(test_ptx),
        cmocka_unit_test(test_ptx_grid),
        cmocka_unit_test(test_grid_normals),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_words_met_late),
        cmocka_unit_test(test_stray_words),
        cmocka_unit_test(test_point_numbers),
        cmocka_unit_test(test_headers),
        cmocka_unit_test(test_quoted_lines),
        cmocka_unit_test(test_bad_scans_are_joined),
        cmocka_unit_test(test_bad_heads),
        cmocka_unit_test(test_announced_points),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
